! SPDX-License-Identifier: MIT
!> Quiet boundaries: dashpots along edges that take up waves (Lysmer and Kuhlemeyer 1969),
!>
!>     traction  -rho c_p (v_n - 2 w_n)  along the normal,   -rho c_s (v_t - 2 w_t)  along the edge,
!>
!> w the velocity of a wave that comes in from outside. The velocity is linear along an edge, so that two points of
!> Gauss integrate the work exactly; it is the mean of the step, as is w. They act once the model has moved in a dynamic
!> step.
module rockdda_interaction_boundary_dashpots
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_elasticity, only : elasticity
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_finite_rotation, only : mean_load
   implicit none
   private
   public :: boundary_dashpots_type

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
   end type dashpot_edge_type

   type :: boundary_dashpots_type
      type(dashpot_edge_type), allocatable :: list(:)
   contains
      procedure :: clear
      procedure :: append_edge
      procedure :: choose_base
      procedure :: add_to_blocks
      procedure :: add_energies
      procedure :: sum_forces
   end type boundary_dashpots_type

contains

   !> None yet.
   pure subroutine clear(self)
      class(boundary_dashpots_type), intent(inout) :: self
      if (allocated(self%list)) deallocate (self%list)
      allocate (self%list(0))
   end subroutine clear

   !> One edge of block b.
   pure subroutine append_edge(self, blocks, parameters, g, b, vertices)
      class(boundary_dashpots_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: g, b            !! boundary, block
      integer, intent(in) :: vertices(2)
      type(dashpot_edge_type) :: edge
      real(wp) :: e(3, 3), along(2)
      associate (m => parameters%block_materials(blocks%block_material(b)))
         e = elasticity(m%youngs_modulus, m%poisson_ratio, parameters%plane_strain)
         edge%impedance = sqrt(m%density*[e(1, 1), e(3, 3)])
      end associate
      edge%group = g
      edge%block = b
      edge%vertices = vertices
      along = blocks%vertices(:, vertices(2)) - blocks%vertices(:, vertices(1))
      edge%is_base = -along(1) < -downwards*norm2(along)
      self%list = [self%list, edge]
   end subroutine append_edge

   !> Where no edge faces down, waves come in at all of them.
   pure subroutine choose_base(self)
      class(boundary_dashpots_type), intent(inout) :: self
      if (.not. any(self%list%is_base)) self%list%is_base = .true.
   end subroutine choose_base

   !> Do the dashpots of this edge act?
   pure logical function acts(edge, context)
      type(dashpot_edge_type), intent(in) :: edge
      type(step_context_type), intent(in) :: context
      acts = context%state%quiet .and. context%state%active(edge%block)
   end function acts

   !> Coefficients of the dashpots of an edge, the rows of their motion, and the motion that waves from outside bring,
   !> twice: the dashpot is stretched by row . d - incoming in the step. Normal and tangent at the first point, then at
   !> the second.
   pure subroutine find_dashpots(edge, context, coefficient, rows, incoming)
      type(dashpot_edge_type), intent(in) :: edge
      type(step_context_type), intent(in) :: context
      real(wp), intent(out) :: coefficient(2)      !! normal, tangential [force time/length]
      real(wp), intent(out) :: rows(6, 2, 2)
      real(wp), intent(out) :: incoming(2)         !! [length]
      real(wp) :: p(2), q(2), along(2), lines(2, 2), wave(2), length
      integer :: i, k
      p = context%state%vertices(:, edge%vertices(1))
      q = context%state%vertices(:, edge%vertices(2))
      length = norm2(q - p)
      along = (q - p)/length
      lines = reshape([along(2), -along(1), along(1), along(2)], [2, 2])
      coefficient = 0.5_wp*length*edge%impedance
      do k = 1, 2
         do i = 1, 2
            rows(:, i, k) = mean_load(lines(:, i), p + merge(gauss, 1 - gauss, k == 1)*(q - p), &
                                      context%moving(edge%block))
         end do
      end do
      incoming = 0
      if (.not. edge%is_base .or. .not. context%ground_motion%acts('viscous_base')) return
      wave = context%ground_motion%displacement('viscous_base', context%motion_time(1.0_wp)) - &
             context%ground_motion%displacement('viscous_base', context%motion_time(0.0_wp))
      incoming = [2*dot_product(lines(:, 1), wave), 2*dot_product(lines(:, 2), wave)]
   end subroutine find_dashpots

   !> Dashpots of all edges.
   subroutine add_to_blocks(self, context, equations)
      class(boundary_dashpots_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(equations_type), intent(inout) :: equations
      real(wp) :: c(2), rows(6, 2, 2), incoming(2), load(6)
      integer :: e, i, j, k
      do e = 1, size(self%list)
         if (.not. acts(self%list(e), context)) cycle
         call find_dashpots(self%list(e), context, c, rows, incoming)
         associate (b => self%list(e)%block)
            do k = 1, 2
               do i = 1, 2
                  do j = 1, 6
                     equations%block_matrix(:, j, b) = equations%block_matrix(:, j, b) + &
                                                       c(i)/context%dt*rows(:, i, k)*rows(j, i, k)
                  end do
                  load = c(i)/context%dt*incoming(i)*rows(:, i, k)
                  equations%block_load(:, b) = equations%block_load(:, b) + load
                  equations%block_magnitude(:, b) = equations%block_magnitude(:, b) + abs(load)
               end do
            end do
         end associate
      end do
   end subroutine add_to_blocks

   !> What the dashpots take, c (row . d)**2/dt, is dissipated; the waves that come in do the work
   !> c incoming (row . d)/dt.
   subroutine add_energies(self, context, d, balance)
      class(boundary_dashpots_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: c(2), rows(6, 2, 2), incoming(2), moved
      integer :: e, i, k
      do e = 1, size(self%list)
         if (.not. acts(self%list(e), context)) cycle
         call find_dashpots(self%list(e), context, c, rows, incoming)
         do k = 1, 2
            do i = 1, 2
               moved = dot_product(rows(:, i, k), d(:, self%list(e)%block))
               call balance%add(energy%dissipated, c(i)/context%dt*moved**2)
               call balance%add(energy%external, c(i)/context%dt*incoming(i)*moved)
            end do
         end do
      end do
   end subroutine add_energies

   !> Add the forces on the blocks in the step to those of each boundary.
   subroutine sum_forces(self, context, d, force)
      class(boundary_dashpots_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      real(wp), intent(in), contiguous :: d(:, :)
      real(wp), intent(inout) :: force(:, :)          !! (2, boundaries)
      real(wp) :: c(2), rows(6, 2, 2), incoming(2)
      integer :: e, i, k
      do e = 1, size(self%list)
         if (.not. acts(self%list(e), context)) cycle
         call find_dashpots(self%list(e), context, c, rows, incoming)
         associate (g => self%list(e)%group)
            do k = 1, 2
               do i = 1, 2
                  ! the first two entries of a row are its direction
                  force(:, g) = force(:, g) - c(i)/context%dt*rows(1:2, i, k)* &
                                (dot_product(rows(:, i, k), d(:, self%list(e)%block)) - incoming(i))
               end do
            end do
         end associate
      end do
   end subroutine sum_forces

end module rockdda_interaction_boundary_dashpots
