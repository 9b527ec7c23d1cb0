! SPDX-License-Identifier: MIT
!> Options that were not given take the constant defaults of the table; options that the run keeps as they are go to
!> its parameters.
module rockdda_model_option_defaults
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_option, only : option_type, option_kind, choice, constant_default, index_of_choice
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_options, only : is_set
   implicit none
   private
   public :: fill_defaults, transfer_options

contains

   !> Fill in options that were not given.
   pure subroutine fill_defaults(table, preset)
      type(option_rows_type), intent(inout) :: table
      logical, intent(in) :: preset                   !! the preset dda_windows holds
      integer :: i
      do i = 1, table%n
         call fill_default(table%rows(i), preset)
      end do
   end subroutine fill_defaults

   !> Fill in one option. A text that was not given, or is blank, becomes the default, which may be empty.
   pure subroutine fill_default(row, preset)
      type(option_type), intent(inout) :: row
      logical, intent(in) :: preset
      associate (given => row%given, default => constant_default(row, preset))
         select case (row%kind)
         case (option_kind%number)
            if (.not. is_set(given%number)) given%number = default
         case (option_kind%whole)
            if (.not. is_set(given%whole) .and. is_set(default)) given%whole = nint(default)
         case (option_kind%text, option_kind%choice)
            if (.not. allocated(given%text)) given%text = ''
            given%text = trim(given%text)
            if (len(given%text) > 0) return
            given%text = row%default_word
            if (preset .and. len(row%preset_word) > 0) given%text = row%preset_word
         end select
      end associate
   end subroutine fill_default

   !> Copy given options to the parameters of the run. A note names each value of the analysis file that is replaced.
   subroutine transfer_options(table, notes)
      type(option_rows_type), intent(inout) :: table
      type(diagnostics_type), intent(inout) :: notes
      integer :: i
      do i = 1, table%n
         if (table%rows(i)%in_run) call transfer_option(table%rows(i), notes)
      end do
   end subroutine transfer_options

   !> Copy one option.
   subroutine transfer_option(row, notes)
      type(option_type), intent(inout) :: row
      type(diagnostics_type), intent(inout) :: notes
      integer :: word
      associate (given => row%given, used => row%used)
         select case (row%kind)
         case (option_kind%number)
            if (.not. is_set(given%number)) return
            call note_replaced(row, used%number, given%number, notes)
            used%number = given%number
         case (option_kind%whole)
            if (.not. is_set(given%whole)) return
            call note_replaced(row, real(used%whole, wp), real(given%whole, wp), notes)
            used%whole = given%whole
         case (option_kind%logical)
            used%flag = given%flag
         case (option_kind%text, option_kind%choice)
            if (row%true_for == 0) then
               used%text = given%text
               return
            end if
            word = index_of_choice(row, given%text)
            used%flag = word == row%true_for
            ! one spelling from here on
            if (word > 0) given%text = choice(row, word)
         case (option_kind%rows, option_kind%file)
            if (allocated(given%rows)) used%rows = given%rows
         end select
      end associate
   end subroutine transfer_option

   !> Note that an option replaces another value of the analysis file.
   subroutine note_replaced(row, old, new, notes)
      type(option_type), intent(in) :: row
      real(wp), intent(in) :: old, new
      type(diagnostics_type), intent(inout) :: notes
      if (row%in_analysis .and. abs(old - new) > 0) call notes%add(severity%note, row%quantity//' '// &
         to_string(new)//' replaces '//to_string(old)//' of the analysis file')
   end subroutine note_replaced

end module rockdda_model_option_defaults
