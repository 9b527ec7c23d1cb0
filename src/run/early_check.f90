! SPDX-License-Identifier: MIT
!> Groups of options that can be judged without a model.
module rockdda_run_early_check
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_check_boundaries, only : check_boundaries
   use rockdda_model_in_situ, only : check_in_situ
   use rockdda_model_options, only : run_options_type
   use rockdda_run_cells, only : check_names
   use rockdda_run_loads, only : check_load_names
   use rockdda_run_water_names, only : check_stage_water
   implicit none
   private
   public :: check_without_model

contains

   !> Groups of &boundary and &in_situ, as far as they can be judged without a model, groups of &water that stages name,
   !> and names of loads.
   subroutine check_without_model(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (allocated(options%boundaries)) call check_boundaries(options%boundaries, messages)
      if (allocated(options%in_situ)) then
         call check_in_situ(options%in_situ, messages)
         do i = 1, size(options%in_situ)
            if (allocated(options%in_situ(i)%region)) call check_names('&in_situ', options%regions, &
               options%in_situ(i)%region, options%in_situ(i)%origin, messages)
         end do
      end if
      call check_stage_water(options, messages)
      call check_load_names(options, messages)
   end subroutine check_without_model

end module rockdda_run_early_check
