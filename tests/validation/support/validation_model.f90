! SPDX-License-Identifier: MIT
!> Models for validation, made of polygons in memory, and the line that each comparison prints.
!>
!>     call model%begin(dt=0.01_wp)                      ! defaults: dynamic, stiffness 1e10, gravity off
!>     call model%add_block_material(2500.0_wp, 1.0e10_wp, 0.25_wp, gravity=9.81_wp)
!>     call model%add_joint_material(30.0_wp)
!>     call model%add_block(rectangle(0.0_wp, 0.0_wp, 2.0_wp, 1.0_wp))
!>     call model%start(sim, error)
!>     call watch%run(sim, 100, error)
!>
!> Whatever is not said here can be set in `model%analysis` and `model%options` before `start`.
module validation_model
   use, intrinsic :: iso_fortran_env, only : output_unit
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_model_analysis_input, only : analysis_input_type, block_material_type, joint_material_type, &
      time_table_type, dialect
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_resolve, only : resolve_parameters
   use rockdda_model_state, only : energy, n_energies
   use rockdda_interaction_kinematics, only : mass_matrix
   use rockdda_contact_view, only : contact_view_type
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: wp, pi, error_type, simulation_type, energy
   public :: model_type, watch_type
   public :: rectangle, turned, shifted, on_slope, holds, holds_ledger
   public :: linear_momentum, angular_momentum, stored_energy, weight_of, block_vertices, block_load

   !> A block system under construction, with everything that a run needs.
   type :: model_type
      type(block_system_type) :: blocks
      type(analysis_input_type) :: analysis
      type(run_options_type) :: options
   contains
      procedure :: begin
      procedure :: add_block_material
      procedure :: add_joint_material
      procedure :: add_block
      procedure :: add_held_block
      procedure :: add_fixed
      procedure :: add_loading
      procedure :: add_measured
      procedure :: add_bolt
      procedure :: start
   end type model_type

   !> What is watched while a run goes on.
   type :: watch_type
      real(wp) :: turned_over = 0   !! largest of all columns of the ledger but the residual, any step [energy]
      real(wp) :: residual = 0      !! largest residual of the ledger, any step [energy]
      real(wp) :: growth = 0        !! largest rise of stored energy less geometry in one step [energy]
      real(wp) :: above_start = -huge(1.0_wp) !! largest stored energy less the first [energy]
      real(wp), private :: at_start = huge(1.0_wp)
      integer :: attempts = 0       !! attempts in all
   contains
      procedure :: run
   end type watch_type

contains

   !> An empty model; dynamic and without weight unless told otherwise.
   subroutine begin(self, dt, k01, stiffness, displacement_ratio)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: dt                              !! largest time step
      real(wp), intent(in), optional :: k01                   !! default 1
      real(wp), intent(in), optional :: stiffness             !! contact stiffness, default 1e10
      real(wp), intent(in), optional :: displacement_ratio    !! g2, default 0.1
      type(block_system_type) :: no_blocks
      type(analysis_input_type) :: no_analysis
      type(run_options_type) :: no_options
      self%blocks = no_blocks
      self%analysis = no_analysis
      self%options = no_options
      self%analysis%dialect = dialect%g0
      self%analysis%n_steps = huge(1)
      self%analysis%dt_max = dt
      self%analysis%k01 = 1
      self%analysis%stiffness = 1.0e10_wp
      self%analysis%displacement_ratio = 0.1_wp
      if (present(k01)) self%analysis%k01 = k01
      if (present(stiffness)) self%analysis%stiffness = stiffness
      if (present(displacement_ratio)) self%analysis%displacement_ratio = displacement_ratio
      allocate (self%analysis%block_materials(0), self%analysis%joint_materials(0), &
                self%analysis%fixed_tables(0), self%analysis%loading_tables(0))
      allocate (self%blocks%vertex_offset(1), self%blocks%vertices(2, 0), self%blocks%edge_joint(0), &
                self%blocks%block_material(0))
      self%blocks%vertex_offset = 0
      call no_points(self%blocks%fixed)
      call no_points(self%blocks%loading)
      call no_points(self%blocks%measured)
      allocate (self%blocks%bolts%ends(4, 0), self%blocks%bolts%blocks(2, 0), self%blocks%bolts%stiffness(0), &
                self%blocks%bolts%pretension(0), self%blocks%bolts%strength(0))
   end subroutine begin

   !> A point set without points.
   pure subroutine no_points(points)
      type(point_set_type), intent(inout) :: points
      points%n = 0
      allocate (points%position(2, 0), points%block(0), points%origin(0))
   end subroutine no_points

   !> Add a block material; numbers count from 1 in the order of the calls.
   subroutine add_block_material(self, density, youngs_modulus, poisson_ratio, gravity, velocity, stress, gradient)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: density, youngs_modulus, poisson_ratio
      real(wp), intent(in), optional :: gravity      !! acceleration in -y, default 0
      real(wp), intent(in), optional :: velocity(3)  !! initial
      real(wp), intent(in), optional :: stress(3), gradient(3)
      type(block_material_type) :: material
      material%density = density
      material%youngs_modulus = youngs_modulus
      material%poisson_ratio = poisson_ratio
      if (present(gravity)) material%weight = density*gravity
      if (present(velocity)) material%velocity = velocity
      if (present(stress)) material%stress = stress
      if (present(gradient)) material%stress_gradient = gradient
      self%analysis%block_materials = [self%analysis%block_materials, material]
   end subroutine add_block_material

   !> Add a joint material; numbers count from 1 in the order of the calls.
   subroutine add_joint_material(self, friction_angle, cohesion, tension)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: friction_angle            !! [deg]
      real(wp), intent(in), optional :: cohesion, tension
      type(joint_material_type) :: material
      material%friction_angle = friction_angle
      if (present(cohesion)) material%cohesion = cohesion
      if (present(tension)) material%tension = tension
      self%analysis%joint_materials = [self%analysis%joint_materials, material]
   end subroutine add_joint_material

   !> Add a block; blocks count from 1 in the order of the calls.
   subroutine add_block(self, polygon, material, joint)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: polygon(:, :)         !! (2, n) counter-clockwise
      integer, intent(in), optional :: material     !! default 1
      integer, intent(in), optional :: joint        !! of all its edges, default 1
      real(wp), allocatable :: vertices(:, :)
      integer :: nv, n, m, j, k
      m = 1
      j = 1
      if (present(material)) m = material
      if (present(joint)) j = joint
      n = size(polygon, 2)
      nv = self%blocks%n_vertices()
      allocate (vertices(2, nv + n))
      vertices(:, 1:nv) = self%blocks%vertices
      vertices(:, nv + 1:) = polygon
      call move_alloc(vertices, self%blocks%vertices)
      self%blocks%edge_joint = [self%blocks%edge_joint, [(j, k=1, n)]]
      self%blocks%block_material = [self%blocks%block_material, m]
      self%blocks%vertex_offset = [self%blocks%vertex_offset, nv + n]
      self%blocks%n_blocks = self%blocks%n_blocks + 1
   end subroutine add_block

   !> Add a block that is held at all its corners.
   subroutine add_held_block(self, polygon, material, joint)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: polygon(:, :)         !! (2, n) counter-clockwise
      integer, intent(in), optional :: material     !! default 1
      integer, intent(in), optional :: joint        !! material of all edges, default 1
      integer :: i
      call self%add_block(polygon, material, joint)
      do i = 1, size(polygon, 2)
         call self%add_fixed(polygon(:, i), self%blocks%n_blocks)
      end do
   end subroutine add_held_block

   !> Add a fixed point, with the rows t x y of its prescribed movement.
   subroutine add_fixed(self, point, block, rows)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: block
      real(wp), intent(in), optional :: rows(:, :)   !! (3, m)
      call add_point(self%blocks%fixed, point, block)
      call add_table(self%analysis%fixed_tables, rows)
   end subroutine add_fixed

   !> Add a loading point with the rows t fx fy of its force.
   subroutine add_loading(self, point, block, rows)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: block
      real(wp), intent(in) :: rows(:, :)             !! (3, m)
      call add_point(self%blocks%loading, point, block)
      call add_table(self%analysis%loading_tables, rows)
   end subroutine add_loading

   !> Add a measured point.
   subroutine add_measured(self, point, block)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: block
      call add_point(self%blocks%measured, point, block)
   end subroutine add_measured

   !> Add a bolt; a block 0 is the fixed outside.
   subroutine add_bolt(self, ends, blocks, stiffness, pretension, strength)
      class(model_type), intent(inout) :: self
      real(wp), intent(in) :: ends(4)
      integer, intent(in) :: blocks(2)
      real(wp), intent(in) :: stiffness, pretension, strength
      associate (b => self%blocks%bolts)
         b%ends = reshape([b%ends, ends], [4, b%n + 1])
         b%blocks = reshape([b%blocks, blocks], [2, b%n + 1])
         b%stiffness = [b%stiffness, stiffness]
         b%pretension = [b%pretension, pretension]
         b%strength = [b%strength, strength]
         b%n = b%n + 1
      end associate
   end subroutine add_bolt

   !> Append a point to a set.
   subroutine add_point(points, point, block)
      type(point_set_type), intent(inout) :: points
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: block
      points%position = reshape([points%position, point], [2, points%n + 1])
      points%block = [points%block, block]
      points%n = points%n + 1
      deallocate (points%origin)
      allocate (points%origin(points%n))
   end subroutine add_point

   !> Append a table, empty when there are no rows.
   subroutine add_table(tables, rows)
      type(time_table_type), allocatable, intent(inout) :: tables(:)
      real(wp), intent(in), optional :: rows(:, :)
      type(time_table_type), allocatable :: longer(:)
      integer :: n, i
      n = size(tables)
      allocate (longer(n + 1))
      do i = 1, n
         longer(i)%rows = tables(i)%rows
      end do
      if (present(rows)) then
         longer(n + 1)%rows = rows
      else
         allocate (longer(n + 1)%rows(3, 0))
      end if
      call move_alloc(longer, tables)
   end subroutine add_table

   !> Resolve the parameters and start a simulation.
   subroutine start(self, sim, error)
      class(model_type), intent(in) :: self
      type(simulation_type), allocatable, intent(inout) :: sim
      type(error_type), allocatable, intent(out) :: error
      type(parameters_type) :: parameters
      type(diagnostics_type) :: messages
      if (allocated(sim)) deallocate (sim)
      allocate (sim)
      call resolve_parameters(self%blocks, self%analysis, self%options, parameters, messages)
      if (messages%has_errors()) then
         call make_error(error, error_code%input, messages%format(severity%error))
         return
      end if
      call sim%init(self%blocks, parameters, error)
   end subroutine start

   !> Advance by so many steps, or to the end of the run, and watch the ledger.
   subroutine run(self, sim, steps, error)
      class(watch_type), intent(inout) :: self
      type(simulation_type), intent(inout) :: sim
      integer, intent(in) :: steps
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: before, now
      integer :: i
      before = stored_energy(sim) - sim%record%energy(energy%geometry)
      if (self%at_start >= huge(1.0_wp)) self%at_start = stored_energy(sim)
      self%turned_over = max(self%turned_over, maxval(abs(sim%record%energy(1:n_energies - 1))))
      do i = 1, steps
         if (sim%is_finished()) exit
         call sim%advance(error)
         if (allocated(error)) then
            write (output_unit, '(a)') error%message
            return
         end if
         self%attempts = self%attempts + sim%record%attempts
         self%turned_over = max(self%turned_over, maxval(abs(sim%record%energy(1:n_energies - 1))))
         self%residual = max(self%residual, abs(sim%record%energy(energy%residual)))
         now = stored_energy(sim) - sim%record%energy(energy%geometry)
         self%growth = max(self%growth, now - before)
         self%above_start = max(self%above_start, stored_energy(sim) - self%at_start)
         before = now
      end do
   end subroutine run

   !> Kinetic, strain, gravity and spring energy.
   pure real(wp) function stored_energy(sim)
      type(simulation_type), intent(in) :: sim
      stored_energy = sum(sim%record%energy([energy%kinetic, energy%strain, energy%gravity, energy%springs]))
   end function stored_energy

   !> Sum of m v.
   pure function linear_momentum(sim) result(p)
      type(simulation_type), intent(in) :: sim
      real(wp) :: p(2)
      integer :: i
      p = 0
      do i = 1, sim%blocks%n_blocks
         p = p + sim%state%mass(i)*sim%state%velocity(1:2, i)
      end do
   end function linear_momentum

   !> Sum of x cross m v and of the blocks' own angular momentum (M v)_3, about the origin.
   pure real(wp) function angular_momentum(sim) result(l)
      type(simulation_type), intent(in) :: sim
      real(wp) :: m(6, 6)
      integer :: i
      l = 0
      do i = 1, sim%blocks%n_blocks
         m = mass_matrix(sim%state%mass(i), sim%state%area(i), sim%state%moments(:, i))
         associate (x => sim%state%centroid(:, i), v => sim%state%velocity(:, i))
            l = l + sim%state%mass(i)*(x(1)*v(2) - x(2)*v(1)) + dot_product(m(3, :), v)
         end associate
      end do
   end function angular_momentum

   !> Weight of one block [force].
   pure real(wp) function weight_of(sim, block)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: block
      associate (m => sim%parameters%block_materials(sim%blocks%block_material(block)))
         weight_of = sim%state%mass(block)*m%weight/m%density
      end associate
   end function weight_of

   !> Vertices of a block now.
   pure function block_vertices(sim, block) result(v)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: block
      real(wp), allocatable :: v(:, :)
      v = sim%state%vertices(:, sim%blocks%vertex_offset(block) + 1:sim%blocks%vertex_offset(block + 1))
   end function block_vertices

   !> Sum of the contact forces on a block in the last step.
   function block_load(sim, block) result(f)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: block
      real(wp) :: f(2)
      type(contact_view_type) :: contacts
      integer :: k
      call sim%view(contacts)
      f = 0
      do k = 1, size(contacts%state)
         if (contacts%blocks(1, k) == block) f = f + contacts%force(:, k)
         if (contacts%blocks(2, k) == block) f = f - contacts%force(:, k)
      end do
   end function block_load

   !> Rectangle with its lower left corner at (x, y).
   pure function rectangle(x, y, width, height) result(p)
      real(wp), intent(in) :: x, y, width, height
      real(wp) :: p(2, 4)
      p = reshape([x, y, x + width, y, x + width, y + height, x, y + height], [2, 4])
   end function rectangle

   !> Points turned about `center`, counter-clockwise.
   pure function turned(points, angle, center) result(p)
      real(wp), intent(in) :: points(:, :)
      real(wp), intent(in) :: angle          !! [rad]
      real(wp), intent(in) :: center(2)
      real(wp) :: p(2, size(points, 2))
      real(wp) :: d(2)
      integer :: i
      do i = 1, size(points, 2)
         d = points(:, i) - center
         p(:, i) = center + [cos(angle)*d(1) - sin(angle)*d(2), sin(angle)*d(1) + cos(angle)*d(2)]
      end do
   end function turned

   !> Points moved by (x, y).
   pure function shifted(points, x, y) result(p)
      real(wp), intent(in) :: points(:, :), x, y
      real(wp) :: p(2, size(points, 2))
      p(1, :) = points(1, :) + x
      p(2, :) = points(2, :) + y
   end function shifted

   !> Points given along (first) and across (second) a slope that falls to the right from the origin.
   pure function on_slope(points, angle) result(p)
      real(wp), intent(in) :: points(:, :), angle
      real(wp) :: p(2, size(points, 2))
      p = turned(points, -angle, [0.0_wp, 0.0_wp])
   end function on_slope

   !> Print a comparison in the form that the test script collects; is the error within the limit?
   logical function holds(name, computed, expected, error, limit)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: computed, expected
      real(wp), intent(in) :: error            !! as defined by the case, >= 0
      real(wp), intent(in) :: limit
      write (output_unit, '(3a,2(es17.9,a),2(es10.2,a))') 'VALIDATION | ', trim(name), ' | ', computed, ' | ', &
         expected, ' | ', error, ' | ', limit
      flush (output_unit)
      holds = error <= limit
   end function holds

   !> The ledger's residual is at most 1e-9 of the largest energy turned over.
   logical function holds_ledger(name, watch)
      character(len=*), intent(in) :: name
      type(watch_type), intent(in) :: watch
      holds_ledger = holds(trim(name)//': ledger residual / energy', watch%residual, 0.0_wp, &
                           watch%residual/watch%turned_over, 1.0e-9_wp)
   end function holds_ledger

end module validation_model
