! SPDX-License-Identifier: MIT
!> JSON text built from its members. Text that is not UTF-8 and numbers that JSON does not have are replaced, so that
!> the result is always valid.
module rockdda_app_json
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string, to_exact_string, utf8_length
   implicit none
   private
   public :: json_type

   type :: json_type
      character(len=:), allocatable :: text
      logical, private :: first = .true.       !! no comma before the next member
   contains
      procedure :: open                        !! begin an object or array
      procedure :: close                       !! end it
      procedure :: append                      !! members that were put into another one
      generic :: put => put_text, put_integer, put_integers, put_long, put_real, put_reals, put_logical
      procedure, private :: put_text, put_integer, put_integers, put_long, put_real, put_reals, put_logical
      procedure, private :: begin_member
   end type json_type

contains

   !> Begin '{' or '['; `name` is '' at the top and inside arrays.
   subroutine open (self, bracket, name)
      class(json_type), intent(inout) :: self
      character(len=1), intent(in) :: bracket
      character(len=*), intent(in) :: name
      call self%begin_member(name)
      self%text = self%text//bracket
      self%first = .true.
   end subroutine open

   !> End an object '}' or array ']'.
   subroutine close (self, bracket)
      class(json_type), intent(inout) :: self
      character(len=1), intent(in) :: bracket
      self%text = self%text//bracket
      self%first = .false.
   end subroutine close

   !> Append members.
   subroutine append(self, members)
      class(json_type), intent(inout) :: self
      type(json_type), intent(in) :: members
      if (.not. allocated(members%text)) return
      call self%begin_member('')
      self%text = self%text//members%text
   end subroutine append

   !> Write the comma and the name of a member.
   subroutine begin_member(self, name)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      if (.not. allocated(self%text)) self%text = ''
      if (.not. self%first) self%text = self%text//', '
      self%first = .false.
      if (len(name) > 0) self%text = self%text//quoted(name)//': '
   end subroutine begin_member

   !> Put a text.
   subroutine put_text(self, name, value, known)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      logical, intent(in), optional :: known     !! .false.: null
      if (is_null(self, name, known)) return
      self%text = self%text//quoted(value)
   end subroutine put_text

   !> Begin a member; where its value is not known put null.
   logical function is_null(self, name, known)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in), optional :: known
      call self%begin_member(name)
      is_null = .false.
      if (present(known)) is_null = .not. known
      if (is_null) self%text = self%text//'null'
   end function is_null

   !> Put a whole number.
   subroutine put_integer(self, name, value)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      call self%begin_member(name)
      self%text = self%text//to_string(value)
   end subroutine put_integer

   !> Put an array of whole numbers.
   subroutine put_integers(self, name, values)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: values(:)
      integer :: i
      call self%open('[', name)
      do i = 1, size(values)
         call self%put('', values(i))
      end do
      call self%close(']')
   end subroutine put_integers

   !> Put a long whole number.
   subroutine put_long(self, name, value)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: value
      call self%begin_member(name)
      self%text = self%text//to_string(value)
   end subroutine put_long

   !> Put a real with all its digits; null when it is not finite.
   subroutine put_real(self, name, value, known)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      logical, intent(in), optional :: known     !! .false.: null
      logical :: there
      there = abs(value) <= huge(value)
      if (present(known)) there = there .and. known
      if (is_null(self, name, there)) return
      self%text = self%text//to_exact_string(value)
   end subroutine put_real

   !> Put an array of reals.
   subroutine put_reals(self, name, values)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      integer :: i
      call self%open('[', name)
      do i = 1, size(values)
         call self%put('', values(i))
      end do
      call self%close(']')
   end subroutine put_reals

   !> Put true or false.
   subroutine put_logical(self, name, value)
      class(json_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: value
      call self%begin_member(name)
      self%text = self%text//trim(merge('true ', 'false', value))
   end subroutine put_logical

   !> Text between quotes, with escape sequences where JSON needs them.
   pure function quoted(text) result(json)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: json
      character(len=6*len(text) + 2) :: buffer
      character(len=6) :: unit
      integer :: i, n, length, used
      buffer(1:1) = '"'
      used = 1
      i = 1
      do while (i <= len(text))
         n = 1
         unit = text(i:i)
         length = 1
         select case (iachar(text(i:i)))
         case (34, 92)
            unit = achar(92)//text(i:i)
            length = 2
         case (10)
            unit = achar(92)//'n'
            length = 2
         case (9)
            unit = achar(92)//'t'
            length = 2
         case (13)
            unit = achar(92)//'r'
            length = 2
         case (0:8, 11:12, 14:31, 127)
            write (unit, '(2a,z4.4)') achar(92), 'u', iachar(text(i:i))
            length = 6
         case (128:)
            n = utf8_length(text(i:))
            if (n == 2 .and. iachar(text(i:i)) == 194 .and. iachar(text(i + n - 1:i + n - 1)) < 160) then
               ! control characters beyond ASCII
               write (unit, '(2a,z4.4)') achar(92), 'u', iachar(text(i + 1:i + 1))
               length = 6
            else if (n > 0) then
               unit = text(i:i + n - 1)
               length = n
            else
               unit = achar(92)//'ufffd'
               length = 6
               n = 1
            end if
         end select
         buffer(used + 1:used + length) = unit(1:length)
         used = used + length
         i = i + n
      end do
      buffer(used + 1:used + 1) = '"'
      json = buffer(1:used + 1)
   end function quoted

end module rockdda_app_json
