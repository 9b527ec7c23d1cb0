! SPDX-License-Identifier: MIT
!> Quiet boundaries: dashpots along edges that take up waves (Lysmer and Kuhlemeyer 1969),
!>
!>     traction  -rho c_p (v_n - 2 w_n)  along the normal,   -rho c_s (v_t - 2 w_t)  along the edge,
!>
!> w the velocity of a wave that comes in from outside. Beside a free field (rockdda_interaction_free_field), 2 w is its
!> velocity, and the traction of its stress is added. The velocity is linear along an edge, so that two points of Gauss
!> integrate the work exactly; it is the mean of the step, as is w. They act once the model has moved in a dynamic step.
module rockdda_interaction_quiet_boundaries
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_ground_options, only : is_quiet
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_block_forces, only : block_forces_type
   use rockdda_interaction_boundary_edges, only : next_vertex
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_load
   use rockdda_interaction_free_field, only : free_field_type, impedances
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_time_scheme, only : purpose
   implicit none
   private
   public :: quiet_boundaries_type

   !> Share of the edge at which the first of two points of Gauss lies.
   real(wp), parameter :: gauss = 0.5_wp - 0.5_wp/1.7320508075688772_wp
   !> Outward normals that are as much downwards as this belong to a base.
   real(wp), parameter :: downwards = 0.70_wp

   type :: dashpot_edge_type
      integer :: group = 0
      integer :: block = 0
      integer :: vertices(2) = 0
      real(wp) :: impedance(2) = 0   !! along the normal and the edge [mass/(length^2 time)]
      logical :: is_base = .false.   !! faces down: waves come in here
      logical :: is_free = .false.   !! beside a free field
      integer :: layer = 0           !! of the free field
   end type dashpot_edge_type

   type, extends(interaction_type) :: quiet_boundaries_type
      type(dashpot_edge_type), allocatable :: list(:)
      type(free_field_type) :: field
      real(wp), allocatable :: force(:, :)   !! (2, boundaries) on the blocks, of the last accepted step
   contains
      procedure :: init
      procedure :: begin
      procedure :: place
      procedure :: add_energies
      procedure :: commit
      procedure :: add_forces
   end type quiet_boundaries_type

contains

   !> Dashpots of all edges that boundaries of these kinds have found, and columns for those of a free field.
   subroutine init(self, blocks, parameters, edges)
      class(quiet_boundaries_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: edges(:, :)     !! (3, edges) boundary, block and first vertex
      integer :: i, n
      if (allocated(self%list)) deallocate (self%list, self%force)
      allocate (self%list(0))
      do i = 1, size(edges, 2)
         associate (g => edges(1, i), b => edges(2, i), k => edges(3, i))
            if (is_quiet(parameters%boundaries(g))) &
               call append_edge(self, blocks, parameters, g, b, [k, next_vertex(blocks, b, k)])
         end associate
      end do
      n = 0
      if (allocated(parameters%boundaries)) n = size(parameters%boundaries)
      allocate (self%force(2, n), source=0.0_wp)
      if (.not. any(self%list%is_base)) self%list%is_base = .not. self%list%is_free
      call place_columns(self, blocks, parameters)
   end subroutine init

   !> One edge of block b.
   pure subroutine append_edge(self, blocks, parameters, g, b, vertices)
      type(quiet_boundaries_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: g, b            !! boundary, block
      integer, intent(in) :: vertices(2)
      type(dashpot_edge_type) :: edge
      real(wp) :: along(2)
      edge%impedance = impedances(blocks, parameters, b)
      edge%group = g
      edge%block = b
      edge%vertices = vertices
      along = blocks%vertices(:, vertices(2)) - blocks%vertices(:, vertices(1))
      edge%is_free = parameters%boundaries(g)%kind == 'free_field'
      edge%is_base = -along(1) < -downwards*norm2(along) .and. .not. edge%is_free
      self%list = [self%list, edge]
   end subroutine append_edge

   !> The columns of the free field: a layer for each edge, from the base up.
   pure subroutine place_columns(self, blocks, parameters)
      type(quiet_boundaries_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, allocatable :: edges(:), vertices(:, :)
      integer :: e, i, k
      edges = pack([(e, e=1, size(self%list))], self%list%is_free)
      do i = 2, size(edges)
         k = i
         do while (k > 1)
            if (.not. below(self%list(edges(k)), self%list(edges(k - 1)))) exit
            edges(k - 1:k) = edges([k, k - 1])
            k = k - 1
         end do
      end do
      allocate (vertices(2, size(edges)))
      do i = 1, size(edges)
         self%list(edges(i))%layer = i
         vertices(:, i) = self%list(edges(i))%vertices
      end do
      call self%field%init(blocks, parameters, self%list(edges)%group, self%list(edges)%block, vertices)
      self%field%on_dashpots = any(self%list%is_base)

   contains

      !> Does an edge come before another one?
      pure logical function below(edge, other)
         type(dashpot_edge_type), intent(in) :: edge, other
         below = edge%group < other%group
         if (edge%group == other%group) below = sum(blocks%vertices(2, edge%vertices)) < &
                                                sum(blocks%vertices(2, other%vertices))
      end function below

   end subroutine place_columns

   !> Do the dashpots of this edge act?
   pure logical function acts(edge, context)
      type(dashpot_edge_type), intent(in) :: edge
      type(step_context_type), intent(in) :: context
      acts = context%state%quiet .and. context%state%active(edge%block)
   end function acts

   !> Coefficients of the dashpots of an edge, the rows of their motion, and the motion outside (of waves that come in
   !> twice): the dashpot is stretched by row . d - outside in the step. Normal and tangent at the first point, then at
   !> the second. And the forces there by the stress outside.
   pure subroutine find_dashpots(self, edge, context, attempt, coefficient, rows, outside, pull)
      class(quiet_boundaries_type), intent(in) :: self
      type(dashpot_edge_type), intent(in) :: edge
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(out) :: coefficient(2)      !! normal, tangential [force time/length]
      real(wp), intent(out) :: rows(6, 2, 2)
      real(wp), intent(out) :: outside(2, 2)       !! (line, point) [length]
      real(wp), intent(out) :: pull(2)             !! along the lines, of each point
      real(wp) :: p(2), q(2), along(2), lines(2, 2), motion(2), length, share
      integer :: i, k
      p = context%state%vertices(:, edge%vertices(1))
      q = context%state%vertices(:, edge%vertices(2))
      length = norm2(q - p)
      along = (q - p)/length
      lines = reshape([along(2), -along(1), along(1), along(2)], [2, 2])
      coefficient = 0.5_wp*length*edge%impedance
      outside = 0
      pull = 0
      if (edge%layer > 0) pull = 0.5_wp*length*matmul(self%field%traction_on(edge%layer, lines(:, 1), &
                                                                             attempt%scheme%level), lines)
      do k = 1, 2
         share = merge(gauss, 1 - gauss, k == 1)
         do i = 1, 2
            rows(:, i, k) = mean_load(lines(:, i), p + share*(q - p), attempt%moving(edge%block))
         end do
         if (edge%layer == 0) cycle
         if (q(2) < p(2)) share = 1 - share
         outside(:, k) = matmul(self%field%motion_at(edge%layer, share), lines)
      end do
      if (.not. edge%is_base) return
      motion = matmul(attempt%ground_step(context, 'viscous_base'), lines)
      outside = 2*spread(motion, 2, 2)
   end subroutine find_dashpots

   !> Motion of the free field in an attempt.
   subroutine begin(self, context, attempt)
      class(quiet_boundaries_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      if (attempt%scheme%purpose /= purpose%turning) call self%field%begin(context, attempt)
   end subroutine begin

   !> Dashpots of all edges, and the stress of the free field.
   subroutine place(self, context, attempt, equations)
      class(quiet_boundaries_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: c(2), rows(6, 2, 2), outside(2, 2), pull(2), load(6)
      integer :: e, i, j, k, l
      if (attempt%scheme%purpose == purpose%turning) return
      do e = 1, size(self%list)
         if (.not. acts(self%list(e), context)) cycle
         call find_dashpots(self, self%list(e), context, attempt, c, rows, outside, pull)
         associate (b => self%list(e)%block)
            do k = 1, 2
               do i = 1, 2
                  l = 0
                  do j = 1, 6
                     equations%block_matrix(l + 1:l + 7 - j, b) = equations%block_matrix(l + 1:l + 7 - j, b) + &
                                                                  c(i)/attempt%dt*rows(j:6, i, k)*rows(j, i, k)
                     l = l + 7 - j
                  end do
                  load = (c(i)/attempt%dt*outside(i, k) + pull(i))*rows(:, i, k)
                  equations%block_load(:, b) = equations%block_load(:, b) + load
                  equations%block_magnitude(:, b) = equations%block_magnitude(:, b) + abs(load)
               end do
            end do
         end associate
      end do
   end subroutine place

   !> At a viscous edge what the dashpots take, c (row . d)**2/dt, is dissipated, and the waves that come in do the work
   !> c outside (row . d)/dt. Beside a free field the dashpots take c (row . d - outside)**2/dt, the free field works by
   !> its motion and its stress.
   subroutine add_energies(self, context, attempt, d, balance)
      class(quiet_boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: c(2), rows(6, 2, 2), outside(2, 2), pull(2), moved, relative
      integer :: e, i, k
      do e = 1, size(self%list)
         if (.not. acts(self%list(e), context)) cycle
         call find_dashpots(self, self%list(e), context, attempt, c, rows, outside, pull)
         do k = 1, 2
            do i = 1, 2
               moved = dot_product(rows(:, i, k), d(:, self%list(e)%block))
               if (self%list(e)%layer > 0) then
                  relative = moved - outside(i, k)
                  call balance%add(energy%dissipated, c(i)/attempt%dt*relative**2)
                  call balance%add(energy%external, pull(i)*moved - c(i)/attempt%dt*relative*outside(i, k))
               else
                  call balance%add(energy%dissipated, c(i)/attempt%dt*moved**2)
                  call balance%add(energy%external, c(i)/attempt%dt*outside(i, k)*moved)
               end if
            end do
         end do
      end do
   end subroutine add_energies

   !> The forces on the blocks in the step, and the free field at its end.
   subroutine commit(self, context, attempt, d)
      class(quiet_boundaries_type), intent(inout) :: self
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      real(wp) :: c(2), rows(6, 2, 2), outside(2, 2), pull(2)
      integer :: e, i, k
      self%force = 0
      do e = 1, size(self%list)
         if (.not. acts(self%list(e), context)) cycle
         call find_dashpots(self, self%list(e), context, attempt, c, rows, outside, pull)
         associate (g => self%list(e)%group)
            do k = 1, 2
               do i = 1, 2
                  ! the first two entries of a row are its direction
                  self%force(:, g) = self%force(:, g) - rows(1:2, i, k)*(c(i)/attempt%dt* &
                                     (dot_product(rows(:, i, k), d(:, self%list(e)%block)) - outside(i, k)) - pull(i))
               end do
            end do
         end associate
      end do
      call self%field%commit(context, attempt)
   end subroutine commit

   !> Forces of the free field's stress on the moved blocks.
   subroutine add_forces(self, context, attempt, forces)
      class(quiet_boundaries_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(block_forces_type), intent(inout) :: forces
      real(wp) :: p(2), q(2), outward(2)
      integer :: e
      do e = 1, size(self%list)
         associate (edge => self%list(e))
            if (edge%layer == 0 .or. .not. acts(edge, context)) cycle
            p = context%state%vertices(:, edge%vertices(1))
            q = context%state%vertices(:, edge%vertices(2))
            outward = [q(2) - p(2), p(1) - q(1)]     ! times the length
            call forces%add_force(edge%block, self%field%traction_on(edge%layer, outward, 0.0_wp), &
                                  0.5_wp*(p + q) - context%state%centroid(:, edge%block))
         end associate
      end do
   end subroutine add_forces

end module rockdda_interaction_quiet_boundaries
