! SPDX-License-Identifier: MIT
!> Hints for mistyped groups and names of namelist files.
module rockdda_io_name_hints
   use rockdda_io_suggest, only : did_you_mean
   implicit none
   private
   public :: name_length, group_hint, name_hint

   integer, parameter :: name_length = 22   !! of groups and names in the tables

   abstract interface
      !> Names of a group; none when the group is unknown.
      pure function names_function(group) result(names)
         import :: name_length
         character(len=*), intent(in) :: group
         character(len=name_length), allocatable :: names(:)
      end function names_function
   end interface

contains

   !> The nearest group, as "; did you mean '&time'?".
   pure function group_hint(group, groups) result(text)
      character(len=*), intent(in) :: group
      character(len=*), intent(in) :: groups(:)     !! valid groups of the file
      character(len=:), allocatable :: text
      character(len=name_length + 1) :: known(size(groups))
      integer :: i
      do i = 1, size(groups)
         known(i) = '&'//groups(i)
      end do
      text = did_you_mean('&'//group, known)
   end function group_hint

   !> Another group that has exactly this name, or else the nearest name of this group.
   pure function name_hint(name, group, groups, names_of) result(text)
      character(len=*), intent(in) :: name, group
      character(len=*), intent(in) :: groups(:)     !! valid groups of the file
      procedure(names_function) :: names_of         !! names of a group
      character(len=:), allocatable :: text
      integer :: i
      do i = 1, size(groups)
         if (.not. any(names_of(trim(groups(i))) == name)) cycle
         text = '; it belongs to &'//trim(groups(i))
         return
      end do
      text = did_you_mean(name, names_of(group))
   end function name_hint

end module rockdda_io_name_hints
