! SPDX-License-Identifier: MIT
!> What a search for the critical factor says about its end.
module rockdda_run_search_notes
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : is_set
   use rockdda_model_units, only : unit_system_type, unit_system
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_run_search_options, only : search_options_type, search_kind, search_names
   use rockdda_run_search_path, only : search_path_type, search_state_type, search_end
   use rockdda_run_trial, only : trial_type
   use rockdda_stepping_verdict, only : typical_size
   implicit none
   private
   public :: describe_motion, describe_shear, no_factor

   !> A stable trial that moves a block by more than this share of a typical block's size has moved something.
   real(wp), parameter :: most_motion = 0.05_wp

contains

   !> A warning when a stable trial came to rest only after motion, beyond any deformation: a mechanism may have moved
   !> and stopped below the factor, so that verdicts need not be monotonic. Else empty.
   function describe_motion(trials, settled, path) result(text)
      type(trial_type), intent(in) :: trials(:)      !! those on the way, in order
      type(simulation_type), intent(in) :: settled
      type(search_path_type), intent(in) :: path
      character(len=:), allocatable :: text
      integer :: i, first
      type(unit_system_type) :: system
      text = ''
      system = unit_system(settled%parameters%units)
      first = 0
      do i = 1, size(trials)
         if (.not. trials(i)%stable) cycle
         if (.not. trials(i)%displacement > most_motion*typical_size(settled)) cycle
         if (first > 0) then
            if (abs(path%sign*trials(i)%value - path%start) >= abs(path%sign*trials(first)%value - path%start)) cycle
         end if
         first = i
      end do
      if (first == 0) return
      text = 'the trial of '//to_string(trials(first)%value, 6)//' came to rest only after a motion of '// &
             system%shown(trials(first)%displacement, 'length', 3)// &
             ': something may have failed below the factor and stopped; '// &
             'look at it with --to '//to_string(trials(first)%value, 6)//' and a model in which it cannot stop'
   end function describe_motion

   !> A warning when a lining bears more shear in a stable trial than its tensile strength: N and M limit its sections,
   !> shear does not, and the factor rests on it. Else empty.
   pure function describe_shear(trials) result(text)
      type(trial_type), intent(in) :: trials(:)
      character(len=:), allocatable :: text
      real(wp) :: shear
      shear = maxval([0.0_wp, trials%shear], mask=[.false., trials%stable])
      text = ''
      if (.not. shear > 1) return
      text = 'a lining without tensile strength bears shear'
      if (shear <= huge(shear)) text = 'a lining has a mean shear stress of up to '//to_string(shear, 3)// &
                                       ' times its tensile strength'
      text = text//' where the model stands: N and M limit its sections, shear does not; the factor rests on what '// &
             'it may not bear'
   end function describe_shear

   !> Why there is no factor, and what to do.
   function no_factor(options, state, trials) result(text)
      type(search_options_type), intent(in) :: options
      type(search_state_type), intent(in) :: state
      type(trial_type), intent(in) :: trials(:)       !! those on the way, in order
      character(len=:), allocatable :: text
      real(wp) :: value
      value = trials(size(trials))%value
      if (options%kind == search_kind%load .and. state%outcome == search_end%never_stable) then
         text = 'fails under '//to_string(value, 3)//' times the loads: nothing carries them'
         if (is_set(options%from)) text = 'not stable under '//to_string(value, 6)// &
                                          ' times the loads, the lower end of the search: begin lower with --from'
         return
      end if
      if (state%outcome == search_end%never_stable) then
         text = 'not stable at '//to_string(value, 6)//', the lower end of the search of the '
      else
         text = 'stable at '//to_string(value, 6)//', the upper end of the search of the '
      end if
      select case (options%kind)
      case (search_kind%tilt); text = text//'tilt'
      case (search_kind%push); text = text//'push'
      case default; text = text//trim(search_names(options%kind))
      end select
      if (state%outcome == search_end%never_stable) then
         text = text//': begin lower with --from, or make the model stable there'
      else
         text = text//': look further with --to, or check that something can fail (joints, cohesion, supports)'
      end if
   end function no_factor

end module rockdda_run_search_notes
