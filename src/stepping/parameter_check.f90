! SPDX-License-Identifier: MIT
!> Parameters with which no run can start, wherever they come from: an analysis file, options, Python or a checkpoint.
module rockdda_stepping_parameter_check
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: check_parameters

contains

   !> Every number must be finite, and those that end a loop must lie in their range.
   subroutine check_parameters(parameters, messages)
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      call demand_finite('t_end', parameters%t_end)
      call demand_finite('k01', parameters%k01)
      call demand_positive('dt_max (g1)', parameters%dt_max)
      call demand_positive('dt_min', parameters%dt_min)
      call demand_positive('displacement_ratio (g2)', parameters%displacement_ratio)
      call demand_finite('w0', parameters%w0)
      call demand_positive('cut_factor', parameters%cut_factor)
      if (.not. parameters%cut_factor < 1) call refuse('cut_factor', parameters%cut_factor, 'below 1')
      call demand_positive('contact stiffness (g0)', parameters%normal_stiffness)
      call demand_finite('shear stiffness', parameters%shear_stiffness)
      call demand_finite('stiffness of fixed points', parameters%fixed_stiffness)
      call demand_finite('search distance', parameters%search_distance)
      call demand_finite('angle_tolerance', parameters%angle_tolerance)
      call demand_finite('close_tolerance', parameters%close_tolerance)
      call demand_finite('open_tolerance', parameters%open_tolerance)
      call demand_finite('mass_proportional', parameters%mass_damping)
      call demand_finite('gravity', parameters%gravity)
      call demand_positive('solver tolerance', parameters%solver_tolerance)
      call demand_finite('SOR factor', parameters%sor_factor)
      if (allocated(parameters%block_materials)) then
         do i = 1, size(parameters%block_materials)
            associate (m => parameters%block_materials(i))
               call demand_all('block material '//to_string(i), [m%density, m%weight, m%youngs_modulus, &
                               m%poisson_ratio, m%stress, m%stress_gradient, m%velocity])
            end associate
         end do
      end if
      if (allocated(parameters%joint_materials)) then
         do i = 1, size(parameters%joint_materials)
            associate (m => parameters%joint_materials(i))
               call demand_all('joint material '//to_string(i), [m%friction_angle, m%cohesion, m%tension])
            end associate
         end do
      end if
      if (allocated(parameters%stages)) then
         do i = 1, size(parameters%stages)
            associate (m => parameters%stages(i))
               call demand_all('stage '//to_string(i), [m%until_time, m%k01, m%gravity])
            end associate
         end do
      end if

   contains

      !> A number that is finite.
      subroutine demand_finite(name, value)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: value
         if (.not. ieee_is_finite(value)) call refuse(name, value, 'finite')
      end subroutine demand_finite

      !> A finite number above 0.
      subroutine demand_positive(name, value)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: value
         if (.not. (ieee_is_finite(value) .and. value > 0)) call refuse(name, value, 'finite and above 0')
      end subroutine demand_positive

      !> All numbers of a material or stage are finite.
      subroutine demand_all(name, values)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: values(:)
         if (.not. all(ieee_is_finite(values))) call messages%add(severity%error, name// &
                                                                  ': all values must be finite')
      end subroutine demand_all

      !> One problem.
      subroutine refuse(name, value, range)
         character(len=*), intent(in) :: name, range
         real(wp), intent(in) :: value
         call messages%add(severity%error, name//' must be '//range//', found '//to_string(value))
      end subroutine refuse

   end subroutine check_parameters

end module rockdda_stepping_parameter_check
