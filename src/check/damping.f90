! SPDX-License-Identifier: MIT
!> Warning of joints without damping in a model whose base moves.
module rockdda_check_damping
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : has_base_motion
   implicit none
   private
   public :: check_damping

contains

   !> Check that joints have damping where the base moves: their springs vibrate, and blocks slip by some percent more
   !> or less than friction lets them, which shorter steps make no better.
   subroutine check_damping(parameters, used, messages)
      type(parameters_type), intent(in) :: parameters
      logical, intent(in) :: used(:)                      !! joint materials of the edges
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      character(len=:), allocatable :: names
      integer :: k, n
      if (parameters%sliding_damping > 0 .or. .not. has_base_motion(parameters%base, parameters%quakes)) return
      names = ''
      n = 0
      do k = 1, size(used)
         associate (joint => parameters%joint_materials(k))
            if (.not. used(k) .or. joint%damping_ratio > 0 .or. joint%tie) cycle
            n = n + 1
            if (n == 1) origin = joint%origin
            if (n > 1) names = names//', '
            names = names//to_string(k)
            if (is_given(joint%name)) names = names//" ('"//trim(joint%name)//"')"
         end associate
      end do
      if (n == 0) return
      names = 'joint material'//trim(merge(' ', 's', n == 1))//' '//names//' '//trim(merge('has ', 'have', n == 1))
      call messages%add(severity%warning, 'the base moves, and '//names//' no damping_ratio: their springs '// &
                        'vibrate, and blocks slip by some percent more or less than friction lets them, which '// &
                        'shorter steps make no better; give damping_ratio = 0.5, for example', origin)
   end subroutine check_damping

end module rockdda_check_damping
