! SPDX-License-Identifier: MIT
!> Elastic strain and initial stress of one block, with their energy.
!>
!> Source: thesis Eqs. 3.5.1 and 3.6.1; the submatrix is S E, without 1/2, and the load of a stress (tension
!> positive) is -S s.
!> Strains are (ex, ey, gxy) with engineering shear, stresses (sx, sy, txy), tension positive, unit thickness;
!> both are constant in a block. They act on rows 4 to 6 of the block's unknowns.
!> Not here: the rotation of stresses with the block (rockdda_interaction_kinematics).
module rockdda_interaction_elasticity
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_blocks, piece, n_pieces
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : energy
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_equations, only : equations_type
   use rockdda_interaction_inertia, only : add_mass_damping, mass_damping_dissipation, carried_velocity
   use rockdda_interaction_interaction, only : interaction_type
   use rockdda_interaction_kinematics, only : mass_matrix
   use rockdda_linear_small_blocks, only : pack_lower, unpack_lower
   implicit none
   private
   public :: elasticity_type, elasticity, compliance, stress_of, add_elastic, add_stress, strain_energy, elastic_energy

   !> Elasticity, initial stress and mass-proportional damping of the blocks.
   type, extends(interaction_type) :: elasticity_type
      real(wp), allocatable :: e(:, :, :)   !! (3, 3, materials)
      real(wp), allocatable :: c(:, :, :)   !! (3, 3, materials) inverse of e
   contains
      procedure :: init
      procedure :: place
      procedure :: add_energies
      procedure :: add_moved_energies
   end type elasticity_type

contains

   !> Elasticity matrix of an isotropic material: stress = E strain.
   pure function elasticity(youngs, poisson, plane_strain) result(e)
      real(wp), intent(in) :: youngs         !! Young's modulus, > 0 [force/length^2]
      real(wp), intent(in) :: poisson        !! in (-1, 0.5)
      logical, intent(in) :: plane_strain    !! else plane stress
      real(wp) :: e(3, 3)                    !! symmetric [force/length^2]
      real(wp) :: direct, cross
      if (plane_strain) then
         direct = youngs*(1 - poisson)/((1 + poisson)*(1 - 2*poisson))
         cross = youngs*poisson/((1 + poisson)*(1 - 2*poisson))
      else
         direct = youngs/(1 - poisson**2)
         cross = poisson*direct
      end if
      e = reshape([direct, cross, 0.0_wp, cross, direct, 0.0_wp, &
                   0.0_wp, 0.0_wp, youngs/(2*(1 + poisson))], [3, 3])
   end function elasticity

   !> Inverse of the elasticity matrix: strain = C stress.
   pure function compliance(youngs, poisson, plane_strain) result(c)
      real(wp), intent(in) :: youngs         !! Young's modulus, > 0 [force/length^2]
      real(wp), intent(in) :: poisson        !! in (-1, 0.5)
      logical, intent(in) :: plane_strain    !! else plane stress
      real(wp) :: c(3, 3)                    !! symmetric [length^2/force]
      real(wp) :: direct, cross
      direct = 1/youngs
      cross = -poisson/youngs
      if (plane_strain) then
         direct = (1 - poisson**2)/youngs
         cross = -poisson*(1 + poisson)/youngs
      end if
      c = reshape([direct, cross, 0.0_wp, cross, direct, 0.0_wp, &
                   0.0_wp, 0.0_wp, 2*(1 + poisson)/youngs], [3, 3])
   end function compliance

   !> Stress of a strain, E e; written out, for matmul makes a temporary array.
   pure function stress_of(e, strain) result(stress)
      real(wp), intent(in) :: e(3, 3)        !! elasticity matrix [force/length^2]
      real(wp), intent(in) :: strain(3)
      real(wp) :: stress(3)
      stress = e(:, 1)*strain(1) + e(:, 2)*strain(2) + e(:, 3)*strain(3)
   end function stress_of

   !> Elastic stiffness S E of a block (Eq. 3.5.1): potential 1/2 S de^T E de of the strain of the step.
   pure subroutine add_elastic(e, area, k)
      real(wp), intent(in) :: e(3, 3)        !! elasticity matrix [force/length^2]
      real(wp), intent(in) :: area           !! at the start of the step [length^2]
      real(wp), intent(inout) :: k(6, 6)     !! diagonal block
      k(4:6, 4:6) = k(4:6, 4:6) + area*e
   end subroutine add_elastic

   !> Load -S s of the stress that a block has at the start of the step (Eq. 3.6.1): potential S s^T de.
   pure subroutine add_stress(stress, area, f)
      real(wp), intent(in) :: stress(3)      !! sx sy txy at the start of the step, tension positive
      real(wp), intent(in) :: area           !! at the start of the step [length^2]
      real(wp), intent(inout) :: f(6)        !! load
      f(4:6) = f(4:6) - area*stress
   end subroutine add_stress

   !> Elastic energy 1/2 S s^T C s of a block.
   pure real(wp) function strain_energy(stress, c, area)
      real(wp), intent(in) :: stress(3)      !! sx sy txy
      real(wp), intent(in) :: c(3, 3)        !! compliance
      real(wp), intent(in) :: area           !! [length^2]
      strain_energy = 0.5_wp*area*dot_product(stress, matmul(c, stress))
   end function strain_energy

   !> Energy of one step. The work done on the block, S s1.de with s1 = s0 + E de, is stored + dissipated:
   !> stored is the change of `strain_energy`, dissipated the numerical part of the implicit step.
   !> With the stress at another level of the step, s0 + level E de, the numerical part is (2 level - 1) times that.
   pure subroutine elastic_energy(e, stress, strain, area, stored, dissipated, level)
      real(wp), intent(in) :: e(3, 3)        !! elasticity matrix
      real(wp), intent(in) :: stress(3)      !! at the start of the step
      real(wp), intent(in) :: strain(3)      !! of the step: d(4:6)
      real(wp), intent(in) :: area           !! at the start of the step [length^2]
      real(wp), intent(out) :: stored        !! [energy]
      real(wp), intent(out) :: dissipated    !! [energy], >= 0
      real(wp), intent(in), optional :: level   !! of the step whose stress acts in it; default 1, its end
      dissipated = 0.5_wp*area*dot_product(strain, matmul(e, strain))
      stored = area*dot_product(stress, strain) + dissipated
      if (present(level)) dissipated = (2*level - 1)*dissipated
   end subroutine elastic_energy

   !> Elasticity and compliance of all block materials.
   pure subroutine init(self, parameters)
      class(elasticity_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      integer :: i, n
      n = size(parameters%block_materials)
      if (allocated(self%e)) deallocate (self%e, self%c)
      allocate (self%e(3, 3, n), self%c(3, 3, n))
      do i = 1, n
         associate (m => parameters%block_materials(i))
            self%e(:, :, i) = elasticity(m%youngs_modulus, m%poisson_ratio, parameters%plane_strain)
            self%c(:, :, i) = compliance(m%youngs_modulus, m%poisson_ratio, parameters%plane_strain)
         end associate
      end do
   end subroutine init

   !> Stiffness, load of the stress at the start of the step, damping.
   subroutine place(self, context, attempt, equations)
      class(elasticity_type), intent(inout) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      type(equations_type), intent(inout) :: equations
      real(wp) :: m(6, 6), k(6, 6), f(6), r, s
      integer :: i
      call attempt%scheme%velocity_shares(r, s)
      !$omp parallel do default(none) shared(self, context, attempt, equations, r) private(i, m, k, f) &
      !$omp schedule(static) if (context%blocks%n_blocks > parallel_blocks)
      do i = 1, context%blocks%n_blocks
         if (attempt%is_left_out(i)) cycle
         associate (area => context%state%area(i), alpha => context%parameters%mass_damping)
            call unpack_lower(equations%block_matrix(:, i), k)
            call add_elastic(self%e(:, :, context%blocks%block_material(i)), attempt%scheme%level*area, k)
            call pack_lower(k, equations%block_matrix(:, i))
            call add_stress(context%state%stress(:, i), area, equations%block_load(:, i))
            equations%block_magnitude(4:6, i) = equations%block_magnitude(4:6, i) + area*abs(context%state%stress(:, i))
            if (.not. alpha > 0) cycle
            m = mass_matrix(context%state%mass(i), area, context%state%moments(:, i))
            call add_mass_damping(r*alpha, m, attempt%dt, k)
            call pack_lower(k, equations%block_matrix(:, i))
            if (.not. attempt%scheme%second_order) cycle
            f = -alpha*matmul(m, carried_velocity(context, attempt, i))
            equations%block_load(:, i) = equations%block_load(:, i) + f
            equations%block_magnitude(:, i) = equations%block_magnitude(:, i) + abs(f)
         end associate
      end do
      !$omp end parallel do
   end subroutine place

   !> Dissipation, and the strain energy at the end of the step with the areas of its start.
   subroutine add_energies(self, context, attempt, d, balance)
      class(elasticity_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      type(attempt_type), intent(in) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: stored, lost, mass(6, 6), r, s
      integer :: i, p, n, m
      n = n_pieces(context%blocks%n_blocks)
      call balance%make_room(context%blocks%n_blocks)
      call attempt%scheme%velocity_shares(r, s)
      !$omp parallel do default(none) shared(self, context, attempt, d, balance, n, r) &
      !$omp private(i, p, m, mass, stored, lost) schedule(static) if (context%blocks%n_blocks > parallel_blocks)
      do p = 1, n
         balance%sums(1:2, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, context%blocks%n_blocks)
            associate (state => context%state, alpha => context%parameters%mass_damping)
               m = context%blocks%block_material(i)
               call elastic_energy(self%e(:, :, m), state%stress(:, i), d(4:6, i), state%area(i), stored, lost, &
                                   attempt%scheme%level)
               if (alpha > 0) then
                  mass = mass_matrix(state%mass(i), state%area(i), state%moments(:, i))
                  lost = lost + mass_damping_dissipation(r*alpha, mass, attempt%dt, d(:, i))
                  if (attempt%scheme%second_order) &
                     lost = lost + alpha*dot_product(d(:, i), matmul(mass, carried_velocity(context, attempt, i)))
               end if
               balance%sums(1, p) = balance%sums(1, p) + lost
               balance%sums(2, p) = balance%sums(2, p) + strain_energy( &
                  state%stress(:, i) + stress_of(self%e(:, :, m), d(4:6, i)), self%c(:, :, m), state%area(i))
            end associate
         end do
      end do
      !$omp end parallel do
      call balance%add(energy%dissipated, sum(balance%sums(1, 1:n)))
      balance%predicted(2) = sum(balance%sums(2, 1:n))
   end subroutine add_energies

   !> Strain energy of the state.
   subroutine add_moved_energies(self, context, balance)
      class(elasticity_type), intent(in) :: self
      type(step_context_type), intent(in) :: context
      class(energy_balance_type), intent(inout) :: balance
      integer :: i, p, n
      n = n_pieces(context%blocks%n_blocks)
      call balance%make_room(context%blocks%n_blocks)
      !$omp parallel do default(none) shared(self, context, balance, n) private(i, p) schedule(static) &
      !$omp if (context%blocks%n_blocks > parallel_blocks)
      do p = 1, n
         balance%sums(1, p) = 0
         do i = (p - 1)*piece + 1, min(p*piece, context%blocks%n_blocks)
            balance%sums(1, p) = balance%sums(1, p) + strain_energy(context%state%stress(:, i), &
               self%c(:, :, context%blocks%block_material(i)), context%state%area(i))
         end do
      end do
      !$omp end parallel do
      balance%moved(2) = sum(balance%sums(1, 1:n))
   end subroutine add_moved_energies

end module rockdda_interaction_elasticity
