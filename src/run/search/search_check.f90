! SPDX-License-Identifier: MIT
!> Check the options of a search against the model.
module rockdda_run_search_check
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_material_names, only : number_of_material
   use rockdda_model_options, only : is_set
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_run_search_options, only : search_options_type, search_kind, search_names
   implicit none
   private
   public :: choose_joints, check_combination, check_values

contains

   !> Which joint materials the search reduces.
   subroutine choose_joints(options, materials, chosen, error)
      type(search_options_type), intent(in) :: options
      type(joint_material_type), intent(in) :: materials(:)
      logical, allocatable, intent(out) :: chosen(:)      !! per material
      type(error_type), allocatable, intent(out) :: error
      character(len=80), allocatable :: names(:)
      character(len=:), allocatable :: rest, word
      integer :: comma, i, m
      allocate (chosen(size(materials)), source=len_trim(options%joints) == 0)
      if (len_trim(options%joints) == 0) return
      if (options%kind /= search_kind%strength) then
         call make_error(error, error_code%input, 'option --joints: only a search of the strength changes joints')
         return
      end if
      allocate (names(size(materials)))
      do i = 1, size(materials)
         names(i) = ''
         if (allocated(materials(i)%name)) names(i) = materials(i)%name
      end do
      rest = options%joints//','
      do while (len(rest) > 0)
         comma = index(rest, ',')
         word = trim(adjustl(rest(1:comma - 1)))
         rest = rest(comma + 1:)
         m = number_of_material(word, materials)
         if (m >= 1 .and. m <= size(materials)) then
            chosen(m) = .true.
            cycle
         end if
         call make_error(error, error_code%input, "option --joints: there is no joint material '"//word//"'"// &
                            did_you_mean(word, names))
         return
      end do
   end subroutine choose_joints

   !> Options that belong to another search.
   subroutine check_combination(options, error)
      type(search_options_type), intent(in) :: options
      type(error_type), allocatable, intent(out) :: error
      if (.not. options%has_factors()) then
         if (len_trim(options%loads) > 0 .and. options%kind /= search_kind%load) call make_error(error, &
            error_code%input, 'option --loads: only --search load and --factors ec7 multiply loads')
      else if (options%kind /= search_kind%strength) then
         call make_error(error, error_code%input, 'option --factors: the reserve of a design is one of strength, '// &
                         'not of --search '//trim(search_names(options%kind)))
      else if (is_set(options%from) .or. is_set(options%to)) then
         call make_error(error, error_code%input, 'options --from, --to: with --factors the search begins at 1')
      end if
   end subroutine check_combination

   !> Values that the search cannot have.
   subroutine check_values(options, tolerance, error)
      type(search_options_type), intent(in) :: options
      real(wp), intent(in) :: tolerance
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: name
      logical :: has_both
      real(wp) :: least
      associate (o => options)
         name = trim(search_names(o%kind))
         has_both = is_set(o%from) .and. is_set(o%to)
         if (has_both) then
            least = tolerance
            if (o%kind == search_kind%load) least = tolerance*max(abs(o%from), abs(o%to))
            if (.not. abs(o%to - o%from) > least) then
               call make_error(error, error_code%input, 'options --from, --to: must be further apart than the '// &
                               'tolerance, '//to_string(least))
               return
            end if
         end if
         select case (o%kind)
         case (search_kind%strength, search_kind%gravity)
            if (is_set(o%from) .and. .not. o%from > 0) call make_error(error, error_code%input, &
               'option --from: a search of the '//name//' needs a value above 0')
            if (is_set(o%to) .and. .not. o%to > 0) call make_error(error, error_code%input, &
               'option --to: a search of the '//name//' needs a value above 0')
            if (has_both .and. .not. o%to > o%from) call make_error(error, error_code%input, &
               'options --from, --to: the model has to be stable at --from and fail at --to, which must be larger')
         case (search_kind%tilt)
            if ((is_set(o%from) .and. abs(o%from) > 90) .or. (is_set(o%to) .and. abs(o%to) > 90)) call make_error( &
               error, error_code%input, 'options --from, --to: a tilt is an angle from -90 to 90 degrees')
            if (has_both .and. .not. allocated(error)) call check_way()
         case (search_kind%push, search_kind%load)
            if (has_both) call check_way()
         end select
      end associate

   contains

      !> A value between 0 and --from is as stable: the search goes away from 0, or to the other side of it.
      subroutine check_way()
         if (abs(options%to) < abs(options%from) .and. options%to*options%from >= 0) call make_error(error, &
            error_code%input, 'options --from, --to: the model has to be stable at --from and fail at --to, which '// &
            'must be further from 0, or on its other side')
      end subroutine check_way

   end subroutine check_values

end module rockdda_run_search_check
