! SPDX-License-Identifier: MIT
!> Numbers of a run that the table of options describes, to and from a checkpoint: each under the name of its option;
!> those of element i of a list under GROUP_i_NAME.
module rockdda_io_parameter_exchange
   use rockdda_base_strings, only : to_string
   use rockdda_model_option, only : option_type, option_value_type, option_kind
   use rockdda_model_option_rows, only : option_rows_type
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
      select case (row%kind)
      case (option_kind%number, option_kind%computed); call archive%item(name, value%number)
      case (option_kind%whole); call archive%item(name, value%whole)
      case (option_kind%logical); call archive%item(name, value%flag)
      case (option_kind%text); call archive%item(name, value%text)
      case (option_kind%choice)
         if (row%true_for > 0) call archive%item(name, value%flag)
         if (row%true_for == 0) call archive%item(name, value%text)
      case (option_kind%numbers); call archive%fixed(name, value%numbers)
      case (option_kind%list); call archive%item(name, value%numbers)
      case (option_kind%wholes); call archive%item(name, value%wholes)
      case (option_kind%rows, option_kind%file, option_kind%record); call archive%item(name, value%rows)
      end select
   end subroutine exchange_value

end module rockdda_io_parameter_exchange
