! SPDX-License-Identifier: MIT
!> Numbers of a run that the table of options describes, to and from a checkpoint: each under the name of its option;
!> those of element i of a list under GROUP_i_NAME. What is loaded must lie in the bounds of its option, or be as in a
!> record of which nothing is given.
module rockdda_io_parameter_exchange
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_model_blocks, only : largest_coordinate
   use rockdda_model_option, only : option_type, option_value_type, option_kind, list_rule, in_bounds, columns_of, &
      index_of_choice
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_options, only : is_set
   use rockdda_io_archive, only : archive_type
   implicit none
   private
   public :: exchange_rows, load_sizes

contains

   !> Load the number of elements of each list of a table without elements, for the table that is loaded then. The last
   !> element must be in the file; otherwise the number is 0, and loading fails.
   subroutine load_sizes(archive, empty, table)
      type(archive_type), intent(inout) :: archive
      type(option_rows_type), intent(in) :: empty
      type(option_rows_type), intent(inout) :: table
      character(len=:), allocatable :: name
      integer :: i, n
      do i = 1, empty%n_groups
         if (.not. empty%groups(i)%is_list) cycle
         name = trim(empty%groups(i)%name)
         n = 0
         call archive%item('n_'//name, n)
         if (allocated(archive%error)) return
         if (n == 0) cycle
         if (archive%has_item(name//'_'//to_string(n))) then
            call table%want(name, n)
         else
            call archive%refuse('n_'//name, 'holds an impossible number')
         end if
      end do
   end subroutine load_sizes

   !> Save or load the values of all rows. Elements of a list are marked by their number.
   subroutine exchange_rows(archive, table)
      type(archive_type), intent(inout) :: archive
      type(option_rows_type), intent(inout) :: table
      character(len=:), allocatable :: prefix
      integer :: i, mark
      if (archive%saving) then
         do i = 1, table%n_groups
            if (table%groups(i)%is_list) call archive%item('n_'//trim(table%groups(i)%name), table%groups(i)%n)
         end do
      end if
      do i = 1, table%n
         associate (row => table%rows(i))
            if (row%element == 0) then
               if (row%in_run) call exchange_value(archive, row%name, row, row%used)
            else
               prefix = trim(table%groups(row%group)%name)//'_'//to_string(row%element)
               mark = row%element
               if (.not. table%is_beside(i, i - 1)) call archive%item(prefix, mark)
               call exchange_value(archive, prefix//'_'//row%name, row, row%given)
            end if
         end associate
      end do
   end subroutine exchange_rows

   !> Save or load one value.
   subroutine exchange_value(archive, name, row, value)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(option_type), intent(in) :: row
      type(option_value_type), intent(inout) :: value
      type(option_value_type) :: before
      before = value
      select case (row%kind)
      case (option_kind%number, option_kind%computed)
         call archive%item(name, value%number)
         call archive%demand(may_be(row, value%number, before%number), name)
      case (option_kind%whole)
         call archive%item(name, value%whole)
         call archive%demand(in_bounds(row, real(value%whole, wp)) .or. value%whole == before%whole, name)
      case (option_kind%logical); call archive%item(name, value%flag)
      case (option_kind%text); call archive%item(name, value%text, row%required)
      case (option_kind%choice)
         if (row%true_for > 0) call archive%item(name, value%flag)
         if (row%true_for == 0) call archive%item(name, value%text, row%required)
         if (row%true_for == 0 .and. allocated(value%text)) &
            call archive%demand(len(value%text) == 0 .or. index_of_choice(row, value%text) > 0, name)
      case (option_kind%numbers); call archive%fixed(name, value%numbers, -largest_coordinate, largest_coordinate)
      case (option_kind%list); call archive%item(name, value%numbers)
      case (option_kind%wholes); call archive%item(name, value%wholes)
      case (option_kind%rows, option_kind%file, option_kind%record)
         call archive%item(name, value%rows)
         if (archive%has_loaded()) call check_rows(archive, name, row, value%rows)
      end select
   end subroutine exchange_value

   !> Can a number be: is it in the bounds, as it was before, or 0 for one that need not be given?
   pure logical function may_be(row, number, before)
      type(option_type), intent(in) :: row
      real(wp), intent(in) :: number, before
      may_be = in_bounds(row, number) .or. .not. abs(number - before) > 0
      if (.not. is_set(before)) may_be = may_be .or. .not. abs(number) > 0
   end function may_be

   !> Check rows of numbers: their columns, and times in order.
   subroutine check_rows(archive, name, row, rows)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(in) :: rows(:, :)
      logical :: rising
      if (.not. allocated(rows)) then
         if (row%required) call archive%refuse(name, 'is missing')
         return
      end if
      if (size(rows, 1) /= size(columns_of(row))) call archive%refuse(name, 'has an unexpected shape')
      rising = row%rule == list_rule%rising .or. row%rule == list_rule%or_constant
      if (row%kind /= option_kind%rows) rising = row%rule /= list_rule%any_order
      if (rising) call archive%demand(all(rows(1, 2:) >= rows(1, :size(rows, 2) - 1)), name)
   end subroutine check_rows

end module rockdda_io_parameter_exchange
