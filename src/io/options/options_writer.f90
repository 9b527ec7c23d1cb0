! SPDX-License-Identifier: MIT
!> Options as the text of an options file: each value that is given, by the table of options. Numbers read back exactly.
module rockdda_io_options_writer
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_option, only : option_type, option_kind
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : all_options, describe_options
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_io_text_output, only : exact_text, exact_row
   implicit none
   private
   public :: options_text

   !> Lines are broken between values beyond this length.
   integer, parameter :: longest_line = 110

contains

   !> The text of an options file with these options: &model and materials come first.
   function options_text(options) result(text)
      type(run_options_type), intent(in) :: options
      character(len=:), allocatable :: text
      character(len=:), allocatable :: head, tail, name, entries, value
      type(option_rows_type) :: table, defaults
      type(run_options_type) :: given
      type(parameters_type) :: no_parameters
      integer :: i, first
      given = options
      call describe_options(table, given, no_parameters)
      defaults = all_options()
      head = ''
      tail = ''
      i = 1
      do while (i <= table%n)
         first = i
         name = trim(table%groups(table%rows(i)%group)%name)
         entries = ''
         do while (table%is_beside(first, i))
            associate (row => table%rows(i))
               value = value_text(row)
               if (is_default(row, defaults)) value = ''
               if (len(value) > 0) call put(entries, name, row%name, value)
            end associate
            i = i + 1
         end do
         if (len(entries) == 0) cycle
         entries = '&'//name//entries//' /'//new_line('a')
         select case (name)
         case ('model', 'block_material', 'joint_material'); head = head//entries
         case default; tail = tail//entries
         end select
      end do
      text = head//tail
   end function options_text

   !> Is a value that may not have been given that of an empty record?
   pure logical function is_default(row, defaults)
      type(option_type), intent(in) :: row
      type(option_rows_type), intent(in) :: defaults
      integer :: i
      is_default = .false.
      do i = 1, defaults%n
         if (defaults%rows(i)%group /= row%group .or. defaults%rows(i)%name /= row%name) cycle
         associate (given => row%given, default => defaults%rows(i)%given)
            select case (row%kind)
            case (option_kind%logical)
               is_default = .not. given%is_given .and. (given%flag .eqv. default%flag)
            case (option_kind%number)
               is_default = row%element > 0 .and. .not. (row%required .or. abs(given%number - default%number) > 0)
            end select
         end associate
      end do
   end function is_default

   !> Add "name = value" to the entries of a group.
   pure subroutine put(entries, group, name, value)
      character(len=:), allocatable, intent(inout) :: entries
      character(len=*), intent(in) :: group, name, value
      character(len=:), allocatable :: line
      line = entries(index(entries, new_line('a'), back=.true.) + 1:)
      if (len(entries) > 0) entries = entries//','
      if (len(line) + len(group) + len(name) + len(value) > longest_line .and. len(line) > 0) &
         entries = entries//new_line('a')//'  '
      entries = entries//' '//name//' = '//value
   end subroutine put

   !> The value of an option as a file has it; empty where none is given.
   pure function value_text(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      associate (given => row%given)
         select case (row%kind)
         case (option_kind%number)
            ! a value on an excluded bound stands for none, as 0 does for a stiffness of joints
            if (is_set(given%number) .and. .not. (row%above .and. given%number <= row%least)) &
               text = exact_text(given%number)
         case (option_kind%whole)
            if (is_set(given%whole)) text = to_string(given%whole)
         case (option_kind%logical)
            text = trim(merge('.true. ', '.false.', given%flag))
         case (option_kind%text, option_kind%choice, option_kind%file, option_kind%record)
            if (.not. allocated(given%text)) return
            if (len_trim(given%text) > 0) text = quoted(given%text)
         case (option_kind%numbers, option_kind%list)
            if (.not. allocated(given%numbers)) return
            if (all(is_set_each(given%numbers))) text = exact_row(given%numbers, ', ')
         case (option_kind%wholes)
            if (.not. allocated(given%wholes)) return
            do i = 1, size(given%wholes)
               if (i > 1) text = text//', '
               text = text//to_string(given%wholes(i))
            end do
         case (option_kind%rows)
            if (.not. allocated(given%rows)) return
            ! each on a line of its own
            do i = 1, size(given%rows, 2)
               if (i > 1) text = text//','//new_line('a')//'    '
               text = text//exact_row(given%rows(:, i), ', ')
            end do
         end select
      end associate
   end function value_text

   !> Which of these were given?
   pure function is_set_each(values) result(given)
      real(wp), intent(in) :: values(:)
      logical :: given(size(values))
      integer :: i
      do i = 1, size(values)
         given(i) = is_set(values(i))
      end do
   end function is_set_each

   !> A text in quotes; a quote in it is doubled.
   pure function quoted(text)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: quoted
      integer :: i
      quoted = "'"
      do i = 1, len_trim(text)
         quoted = quoted//text(i:i)
         if (text(i:i) == "'") quoted = quoted//"'"
      end do
      quoted = quoted//"'"
   end function quoted

end module rockdda_io_options_writer
