! SPDX-License-Identifier: MIT
!> Warnings of joints without damping in a model whose base moves, and of damping of blocks that lets nothing move.
module rockdda_check_damping
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : is_given, to_string
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_stage_options, only : has_base_motion
   implicit none
   private
   public :: check_damping, check_mass_damping

   !> Steps in which damping may take the velocity of a block.
   real(wp), parameter :: least_steps = 3.0_wp

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

   !> Check that damping in proportion to mass leaves blocks their velocity for some steps.
   subroutine check_mass_damping(parameters, origin, messages)
      type(parameters_type), intent(in) :: parameters
      type(origin_type), intent(in) :: origin             !! of its value
      type(diagnostics_type), intent(inout) :: messages
      if (.not. parameters%mass_damping*parameters%dt_max*least_steps > 1) return
      associate (alpha => parameters%mass_damping)
         call messages%add(severity%warning, 'mass_proportional takes the velocity of blocks within '// &
            parameters%shown(1/alpha, 'time', 3)//', '//to_string(1/(alpha*parameters%dt_max), 2)// &
            ' of the longest step: they fall no faster than '// &
            parameters%shown(parameters%acceleration_of_gravity()/alpha, 'length/time', 3)//' and stand still '// &
            'where they should slide. Critical damping of an oscillation of frequency f is 4 pi f', origin)
      end associate
   end subroutine check_mass_damping

end module rockdda_check_damping
