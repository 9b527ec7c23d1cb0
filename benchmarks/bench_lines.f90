! SPDX-License-Identifier: MIT
!> One JSON object on one line, built member by member.
module bench_lines
   use rockdda_base_kinds, only : wp, i8
   implicit none
   private
   public :: line_type

   type :: line_type
      character(len=:), allocatable, private :: members
   contains
      procedure :: text => add_text
      procedure :: integer => add_integer
      procedure :: integer8 => add_integer8
      procedure :: real => add_real
      procedure :: open => open_object
      procedure :: close => close_object
      procedure :: put
      procedure, private :: add
   end type line_type

contains

   !> Add a text without quotes or control characters.
   subroutine add_text(self, name, value)
      class(line_type), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      call self%add(name, '"'//value//'"')
   end subroutine add_text

   !> Add an integer.
   subroutine add_integer(self, name, value)
      class(line_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      call self%integer8(name, int(value, i8))
   end subroutine add_integer

   !> Add a 64-bit integer.
   subroutine add_integer8(self, name, value)
      class(line_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: value
      character(len=24) :: digits
      write (digits, '(i0)') value
      call self%add(name, trim(digits))
   end subroutine add_integer8

   !> Add a real number.
   subroutine add_real(self, name, value)
      class(line_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=24) :: digits
      write (digits, '(es16.9)') value
      call self%add(name, trim(adjustl(digits)))
   end subroutine add_real

   !> Begin an object as a member.
   subroutine open_object(self, name)
      class(line_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      call self%add(name, '{')
   end subroutine open_object

   !> End the object.
   subroutine close_object(self)
      class(line_type), intent(inout) :: self
      self%members = self%members//'}'
   end subroutine close_object

   !> Write the object and begin the next one.
   subroutine put(self, unit)
      class(line_type), intent(inout) :: self
      integer, intent(in) :: unit
      if (.not. allocated(self%members)) self%members = ''
      write (unit, '(a)') '{'//self%members//'}'
      flush (unit)
      deallocate (self%members)
   end subroutine put

   !> Add a member, its value as text.
   subroutine add(self, name, value)
      class(line_type), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      if (.not. allocated(self%members)) then
         self%members = ''
      else if (self%members(len(self%members):) /= '{') then
         self%members = self%members//', '
      end if
      self%members = self%members//'"'//name//'": '//value
   end subroutine add

end module bench_lines
