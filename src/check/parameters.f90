! SPDX-License-Identifier: MIT
!> Parameters with which no run can start, wherever they come from: an analysis file, options, Python or a checkpoint.
module rockdda_check_parameters
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: check_parameters

   !> Young's modulus [force/length^2]: the inverse of the largest number that files may hold.
   real(wp), parameter :: smallest_modulus = 1.0e-60_wp

contains

   !> Every number must be finite, and those that end a loop must lie in their range.
   subroutine check_parameters(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      associate (p => parameters)
         call demand('finite', messages, 't_end', [p%t_end])
         call demand('finite', messages, 'k01', [p%k01])
         call demand('finite and above 0', messages, 'dt_max (g1)', [p%dt_max])
         call demand('finite and above 0', messages, 'dt_min', [p%dt_min])
         call demand('finite and above 0', messages, 'displacement_ratio (g2)', [p%displacement_ratio])
         call demand('finite', messages, 'w0', [p%w0])
         call demand('finite and above 0', messages, 'cut_factor', [p%cut_factor])
         if (.not. p%cut_factor < 1) call messages%add(severity%error, 'cut_factor must be below 1, found '// &
                                                       to_string(p%cut_factor))
         call demand('finite and above 0', messages, 'contact stiffness (g0)', [p%normal_stiffness])
         call demand('finite', messages, 'shear stiffness', [p%shear_stiffness])
         call demand('finite', messages, 'stiffness of fixed points', [p%fixed_stiffness])
         call demand('finite', messages, 'search distance', [p%search_distance])
         call demand('finite', messages, 'angle_tolerance', [p%angle_tolerance])
         call demand('finite', messages, 'close_tolerance', [p%close_tolerance])
         call demand('finite', messages, 'open_tolerance', [p%open_tolerance])
         call demand('finite', messages, 'mass_proportional', [p%mass_damping])
         call demand('finite', messages, 'gravity', [p%gravity])
         call demand('finite and above 0', messages, 'solver tolerance', [p%solver_tolerance])
         call demand('finite', messages, 'SOR factor', [p%sor_factor])
      end associate
      if (allocated(parameters%block_materials)) then
         do i = 1, size(parameters%block_materials)
            associate (m => parameters%block_materials(i))
               call demand('finite', messages, 'block material '//to_string(i), [m%density, m%weight, &
                           m%youngs_modulus, m%poisson_ratio, m%stress, m%stress_gradient, m%velocity], m%origin)
               call demand_modulus(messages, 'block material '//to_string(i), m%youngs_modulus, m%origin)
            end associate
         end do
      end if
      if (allocated(parameters%changes)) then
         do i = 1, size(parameters%changes)
            if (is_set(parameters%changes(i)%young)) &
               call demand_modulus(messages, '&change '//to_string(i), parameters%changes(i)%young, &
                                   parameters%changes(i)%origin)
         end do
      end if
      if (allocated(parameters%joint_materials)) then
         do i = 1, size(parameters%joint_materials)
            associate (m => parameters%joint_materials(i))
               call demand('finite', messages, 'joint material '//to_string(i), &
                           [m%friction_angle, m%cohesion, m%tension], m%origin)
            end associate
         end do
      end if
      if (allocated(parameters%stages)) then
         do i = 1, size(parameters%stages)
            associate (m => parameters%stages(i))
               call demand('finite', messages, 'stage '//to_string(i), [m%until_time, m%k01, m%gravity], &
                           m%origin)
            end associate
         end do
      end if
   end subroutine check_parameters

   !> Strains under any stress that a model may have must be finite numbers, and their energies.
   subroutine demand_modulus(messages, name, modulus, origin)
      type(diagnostics_type), intent(inout) :: messages
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: modulus
      type(origin_type), intent(in) :: origin            !! where the group was read that has it; or empty
      if (modulus < smallest_modulus) call messages%add(severity%error, name//": Young's modulus must be at least "// &
                                                        to_string(smallest_modulus)//', found '//to_string(modulus), &
                                                        origin)
   end subroutine demand_modulus

   !> A value, or all values of a material or stage, must lie in a range.
   subroutine demand(range, messages, name, values, origin)
      character(len=*), intent(in) :: range              !! 'finite' or 'finite and above 0'
      type(diagnostics_type), intent(inout) :: messages
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      type(origin_type), intent(in), optional :: origin  !! as of `demand_modulus`
      if (all(ieee_is_finite(values)) .and. (range == 'finite' .or. all(values > 0))) return
      if (size(values) == 1) then
         call messages%add(severity%error, name//' must be '//range//', found '//to_string(values(1)))
      else
         call messages%add(severity%error, name//': all values must be '//range, origin)
      end if
   end subroutine demand

end module rockdda_check_parameters
