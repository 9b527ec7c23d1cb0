! SPDX-License-Identifier: MIT
!> Free field: the ground beside a model, computed along with it as columns of layers.
!>
!> A column has a layer for each edge of its boundary, with the height, the material and the joints of the blocks there.
!> Nothing changes along x in it, so that a layer has the displacements u of its bottom and its top and the strains
!>
!>     gxy = (u_x,top - u_x,bottom)/h,    ey = (u_y,top - u_y,bottom)/h,    ex = 0,
!>
!> the block of the method that is sheared without turning. x and y are two chains of their own, with the consistent
!> mass rho h/6 (2 1; 1 2) of a layer, its stiffness E_33/h or E_22/h, and springs and dashpots of the joints between
!> layers, all per unit of length along x. The bottom stands on dashpots where the model has a viscous base, else it
!> moves with the ground. Columns do not feel the model; all quantities count from the static state in which they begin.
module rockdda_interaction_free_field
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_dashpots, only : dashpots_of
   use rockdda_interaction_elasticity, only : elasticity
   use rockdda_interaction_loads, only : base_motion
   use rockdda_interaction_time_scheme, only : time_scheme_type, shi_scheme, purpose
   implicit none
   private
   public :: free_field_type, impedances

   !> Stiffness, over that of the layer, of joints that are none: within a block, or between blocks that do not touch.
   real(wp), parameter :: rigid = 1.0e4_wp

   !> Layers from the base up, one column after the other.
   type :: free_field_type
      integer, allocatable :: group(:)                 !! (n) boundary, one column each
      integer, allocatable :: block(:)                 !! (n) at the boundary
      real(wp), allocatable :: height(:)               !! (n) [length]
      real(wp), allocatable :: density(:)              !! (n) [mass/length^2]
      real(wp), allocatable :: modulus(:, :)           !! (2, n) of shear, and along y [force/length^2]
      real(wp), allocatable :: lateral(:)              !! (n) stress along x over the strain along y
      logical :: on_dashpots = .false.                 !! a viscous base
      logical :: has_joints = .false.                  !! those of contacts; state
      ! state: joints below the layers, from the contacts in the static state, per length along x
      real(wp), allocatable :: joint(:, :)             !! (2, n) stiffness along x and y [force/length^2]
      real(wp), allocatable :: drag(:, :)              !! (2, n) dashpots [force time/length^2]
      ! state: (2, 2 n) along x and y, of bottom and top of each layer
      real(wp), allocatable :: displacement(:, :), velocity(:, :), acceleration(:, :)
      ! of the attempt
      real(wp), allocatable :: motion(:, :)            !! (2, 2 n) in the step [length]
   contains
      procedure :: init
      procedure :: take_joints
      procedure :: begin
      procedure :: commit
      procedure :: slow_down
      procedure :: motion_at
      procedure :: traction_on
      procedure :: exchange_state
      procedure, private :: find_motion
   end type free_field_type

contains

   !> Impedances rho c of waves in a block, of compression and of shear [mass/(length^2 time)].
   pure function impedances(blocks, parameters, b) result(z)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: b
      real(wp) :: z(2)
      real(wp) :: e(3, 3)
      associate (m => parameters%block_materials(blocks%block_material(b)))
         e = elasticity(m%youngs_modulus, m%poisson_ratio, parameters%plane_strain)
         z = sqrt(m%density*[e(1, 1), e(3, 3)])
      end associate
   end function impedances

   !> Layers for edges of boundaries, in the order of the columns, from the base up; at rest.
   pure subroutine init(self, blocks, parameters, groups, edge_blocks, vertices)
      class(free_field_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: groups(:), edge_blocks(:)   !! (n) boundary and block of each edge
      integer, intent(in) :: vertices(:, :)              !! (2, n) its ends
      real(wp) :: e(3, 3)
      integer :: l, n
      n = size(groups)
      self%group = groups
      self%block = edge_blocks
      if (allocated(self%height)) deallocate (self%height, self%density, self%modulus, self%lateral, self%joint, &
                                              self%drag, self%displacement, self%velocity, self%acceleration, &
                                              self%motion)
      allocate (self%height(n), self%density(n), self%modulus(2, n), self%lateral(n), self%joint(2, n))
      allocate (self%drag(2, n), self%displacement(2, 2*n), self%velocity(2, 2*n), self%acceleration(2, 2*n), &
                self%motion(2, 2*n), source=0.0_wp)
      do l = 1, n
         associate (m => parameters%block_materials(blocks%block_material(edge_blocks(l))))
            e = elasticity(m%youngs_modulus, m%poisson_ratio, parameters%plane_strain)
            self%density(l) = m%density
         end associate
         self%height(l) = abs(blocks%vertices(2, vertices(2, l)) - blocks%vertices(2, vertices(1, l)))
         self%modulus(:, l) = [e(3, 3), e(2, 2)]
         self%lateral(l) = e(1, 2)
         self%joint(:, l) = rigid*self%modulus(:, l)/self%height(l)
      end do
   end subroutine init

   !> Before the first dynamic step, whose contacts are in the table: the joints between layers are the closed contacts
   !> between their blocks, per length along x.
   subroutine take_joints(self, context, attempt, laws, table)
      class(free_field_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(joint_law_type), intent(in) :: laws(:)      !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp), allocatable :: drag(:, :)
      real(wp) :: springs(2), dashpots(2), across(2), length, k_n
      integer :: c, l
      if (self%has_joints .or. size(self%group) == 0 .or. .not. context%state%quiet) return
      self%has_joints = .true.
      drag = dashpots_of(context, attempt, laws, table)
      do l = 2, size(self%group)
         if (self%group(l) /= self%group(l - 1)) cycle
         springs = 0
         dashpots = 0
         length = 0
         do c = 1, table%n
            if (table%state(c) == contact_state%open .and. table%gap(c) > 0) cycle
            if (.not. (all([table%block_a(c), table%block_b(c)] == self%block(l - 1:l)) .or. &
                       all([table%block_b(c), table%block_a(c)] == self%block(l - 1:l)))) cycle
            across = table%normal(:, c)**2               ! the tangent has the same, the other way round
            k_n = laws(table%joint(c))%normal%tangent(table%k_n(c), table%normal_force(c))
            springs = springs + [k_n*across(1) + table%k_s(c)*across(2), k_n*across(2) + table%k_s(c)*across(1)]
            dashpots = dashpots + [drag(1, c)*across(1) + drag(2, c)*across(2), &
                                   drag(1, c)*across(2) + drag(2, c)*across(1)]
            length = length + table%length(c)*abs(table%normal(2, c))
         end do
         if (.not. (length > 0 .and. all(springs > 0))) cycle
         self%joint(:, l) = springs/length
         self%drag(:, l) = dashpots/length
      end do
   end subroutine take_joints

   !> Motion of the columns in an attempt. Where accelerations of the start are sought, theirs.
   subroutine begin(self, context, attempt)
      class(free_field_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(time_scheme_type) :: at_rest
      if (size(self%group) == 0 .or. .not. context%state%quiet) return
      if (attempt%scheme%purpose /= purpose%acceleration) then
         call self%find_motion(context, attempt, attempt%scheme, self%velocity, self%acceleration)
         return
      end if
      at_rest = shi_scheme()
      self%acceleration = 0
      call self%find_motion(context, attempt, at_rest, self%acceleration, self%acceleration)
      self%acceleration = (2/attempt%dt**2)*self%motion
      self%motion = 0
   end subroutine begin

   !> Solve the chains of all columns for the motion of a step.
   pure subroutine find_motion(self, context, attempt, scheme, velocity, acceleration)
      class(free_field_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(time_scheme_type), intent(in) :: scheme
      real(wp), intent(in) :: velocity(:, :), acceleration(:, :)   !! (2, 2 n) at the start of the step
      integer :: axis, first, last, n
      n = size(self%group)
      first = 1
      do while (first <= n)
         last = first
         do while (last < n)
            if (self%group(last + 1) /= self%group(first)) exit
            last = last + 1
         end do
         do axis = 1, 2
            call solve_chain(self, context, attempt, scheme, axis, first, last, velocity(axis, 2*first - 1:2*last), &
                             acceleration(axis, 2*first - 1:2*last), self%motion(axis, 2*first - 1:2*last))
         end do
         first = last + 1
      end do
   end subroutine find_motion

   !> Motion of one column along one axis: a tridiagonal system.
   pure subroutine solve_chain(self, context, attempt, scheme, axis, first, last, velocity, acceleration, motion)
      class(free_field_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(time_scheme_type), intent(in) :: scheme
      integer, intent(in) :: axis, first, last
      real(wp), intent(in) :: velocity(:), acceleration(:)   !! (nodes) at the start of the step
      real(wp), intent(out) :: motion(:)                     !! (nodes)
      real(wp) :: diagonal(size(motion)), beside(size(motion)), load(size(motion))   !! `beside`: to the next node
      real(wp) :: carried(2), base(2), ground(2), mass, k, c, r, s
      integer :: l, i, n
      n = size(motion)
      diagonal = 0
      beside = 0
      load = 0
      base = base_motion(context, attempt)
      call scheme%velocity_shares(r, s)
      associate (dt => attempt%dt, damping => context%parameters%mass_damping, u => self%displacement(axis, :))
         do l = first, last
            i = 2*(l - first) + 1
            mass = self%density(l)*self%height(l)/6
            c = mass*(scheme%inertia/dt**2 + r*damping/dt)
            k = scheme%level*self%modulus(axis, l)/self%height(l)
            diagonal(i:i + 1) = diagonal(i:i + 1) + 2*c + k
            beside(i) = c - k
            carried = mass*((scheme%inertia/dt)*velocity(i:i + 1) + (0.5_wp*scheme%inertia - 1)*acceleration(i:i + 1) &
                            - base(axis))
            if (damping > 0 .and. scheme%second_order) &
               carried = carried - mass*damping*((1 - r)*velocity(i:i + 1) + s*dt*acceleration(i:i + 1))
            k = self%modulus(axis, l)/self%height(l)*(u(2*l) - u(2*l - 1))
            load(i:i + 1) = load(i:i + 1) + [2*carried(1) + carried(2) + k, carried(1) + 2*carried(2) - k]
            if (l == first) cycle
            k = scheme%level*self%joint(axis, l) + self%drag(axis, l)/dt
            diagonal(i - 1:i) = diagonal(i - 1:i) + k
            beside(i - 1) = -k
            k = self%joint(axis, l)*(u(2*l - 1) - u(2*l - 2))
            load(i - 1:i) = load(i - 1:i) + [k, -k]
         end do
         if (self%on_dashpots) then
            ground = attempt%ground_step(context, 'viscous_base')
            c = sqrt(self%density(first)*self%modulus(axis, first))/dt
            diagonal(1) = diagonal(1) + c
            load(1) = load(1) + 2*c*ground(axis)
         else
            ground = attempt%ground_step(context, 'base_motion')
            load(2) = load(2) - beside(1)*ground(axis)
            load(1) = ground(axis)
            diagonal(1) = 1
            beside(1) = 0
         end if
      end associate
      do i = 2, n
         diagonal(i) = diagonal(i) - beside(i - 1)**2/diagonal(i - 1)
         load(i) = load(i) - beside(i - 1)/diagonal(i - 1)*load(i - 1)
      end do
      motion(n) = load(n)/diagonal(n)
      do i = n - 1, 1, -1
         motion(i) = (load(i) - beside(i)*motion(i + 1))/diagonal(i)
      end do
   end subroutine solve_chain

   !> Take over the motion of an accepted step.
   subroutine commit(self, context, attempt)
      class(free_field_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), allocatable :: new(:, :)
      if (size(self%group) == 0 .or. .not. context%state%quiet) return
      associate (scheme => attempt%scheme, dt => attempt%dt)
         new = scheme%new_acceleration(self%motion, self%velocity, self%acceleration, 0.0_wp, dt)
         self%velocity = self%velocity + scheme%velocity_change(self%acceleration, new, 0.0_wp, dt)
      end associate
      self%acceleration = new
      self%displacement = self%displacement + self%motion
   end subroutine commit

   !> Carry on a share of the velocities.
   pure subroutine slow_down(self, k01)
      class(free_field_type), intent(inout) :: self
      real(wp), intent(in) :: k01
      self%velocity = k01*self%velocity
   end subroutine slow_down

   !> Motion of a layer in the step, at a share of its height.
   pure function motion_at(self, layer, share) result(motion)
      class(free_field_type), intent(in) :: self
      integer, intent(in) :: layer
      real(wp), intent(in) :: share
      real(wp) :: motion(2)                  !! [length]
      motion = (1 - share)*self%motion(:, 2*layer - 1) + share*self%motion(:, 2*layer)
   end function motion_at

   !> Traction on a block whose outward normal is `normal`, of the stress in a layer at a level of the step.
   pure function traction_on(self, layer, normal, level) result(traction)
      class(free_field_type), intent(in) :: self
      integer, intent(in) :: layer
      real(wp), intent(in) :: normal(2), level
      real(wp) :: traction(2)                !! [force/length]
      real(wp) :: strain(2)                  !! of shear, and along y
      associate (bottom => 2*layer - 1, top => 2*layer)
         strain = (self%displacement(:, top) - self%displacement(:, bottom) + &
                   level*(self%motion(:, top) - self%motion(:, bottom)))/self%height(layer)
      end associate
      associate (shear => self%modulus(1, layer)*strain(1))
         traction = [self%lateral(layer)*strain(2)*normal(1) + shear*normal(2), &
                     shear*normal(1) + self%modulus(2, layer)*strain(2)*normal(2)]
      end associate
   end function traction_on

   !> Save or load joints and motion.
   subroutine exchange_state(self, archive)
      class(free_field_type), intent(inout) :: self
      class(state_archive_type), intent(inout) :: archive
      integer :: n
      n = size(self%group)
      if (n == 0) return
      call archive%section('free_field')
      call archive%item('has_joints', self%has_joints)
      call archive%item('joint', self%joint, [2, n])
      call archive%item('drag', self%drag, [2, n])
      call archive%item('displacement', self%displacement, [2, 2*n])
      call archive%item('velocity', self%velocity, [2, 2*n])
      call archive%item('acceleration', self%acceleration, [2, 2*n])
   end subroutine exchange_state

end module rockdda_interaction_free_field
