! SPDX-License-Identifier: MIT
!> Many small values under their names in four datasets instead of one each, which HDF5 takes for some ten microseconds
!> apiece:
!>
!>     small/reals, small/integers, small/texts    all values of a kind in sequence, letters as bytes
!>     small/index                                 a line for each, in the same order: its name, its kind, and its shape
!>
!>     parameters/g1 real                          one number
!>     control/cuts integer 2                      a list of two
!>     model/vertices real 2 12                    2 numbers in each of 12 rows
!>     results/title text 14                       14 bytes
module rockdda_io_small_values
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_room, only : grow
   use rockdda_base_strings, only : to_string
   implicit none
   private
   public :: small_values_type, small_entry_type, small_kind

   type :: small_kinds_type
      integer :: none = 0, reals = 1, integers = 2, text = 3
   end type small_kinds_type
   type(small_kinds_type), parameter :: small_kind = small_kinds_type()
   character(len=*), parameter :: kind_names(3) = [character(len=7) :: 'real', 'integer', 'text']

   !> A value: its kind, its shape, and the place before its first number or letter.
   type :: small_entry_type
      integer :: kind = 0
      integer :: rank = 1
      integer :: shape(2) = 1
      integer :: size = 1
      integer :: before = 0
      integer, private :: first = 1, last = 0   !! letters of the name in the index
   end type small_entry_type

   type :: small_values_type
      integer :: n_reals = 0, n_integers = 0, n_letters = 0, n_index = 0
      real(wp), allocatable :: reals(:)             !! (>= n_reals)
      integer, allocatable :: integers(:)           !! (>= n_integers)
      character(len=:), allocatable :: texts        !! (>= n_letters)
      character(len=:), allocatable :: index        !! (>= n_index)
      type(small_entry_type), allocatable, private :: entries(:)   !! of what is read
      integer, private :: present = 1               !! entry that was found last
   contains
      procedure :: start
      procedure :: add_reals
      procedure :: add_integers
      procedure :: add_text
      procedure :: take_index
      procedure :: find
      procedure, private :: add_line, is_entry
   end type small_values_type

contains

   !> Begin without values.
   pure subroutine start(self)
      class(small_values_type), intent(inout) :: self
      self%n_reals = 0
      self%n_integers = 0
      self%n_letters = 0
      self%n_index = 0
      self%present = 1
      self%reals = [real(wp) ::]
      self%integers = [integer ::]
      self%texts = ''
      self%index = ''
      if (allocated(self%entries)) deallocate (self%entries)
      allocate (self%entries(0))
   end subroutine start

   !> Append reals.
   pure subroutine add_reals(self, name, shape, values)
      class(small_values_type), intent(inout) :: self
      character(len=*), intent(in) :: name        !! without blanks
      integer, intent(in) :: shape(:)             !! of one or two numbers
      real(wp), intent(in) :: values(:)           !! (product(shape))
      integer :: n
      call self%add_line(name, small_kind%reals, shape)
      n = self%n_reals + size(values)
      call grow(self%reals, n)
      self%reals(self%n_reals + 1:n) = values
      self%n_reals = n
   end subroutine add_reals

   !> Append integers.
   pure subroutine add_integers(self, name, shape, values)
      class(small_values_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: shape(:)
      integer, intent(in) :: values(:)
      integer :: n
      call self%add_line(name, small_kind%integers, shape)
      n = self%n_integers + size(values)
      call grow(self%integers, n)
      self%integers(self%n_integers + 1:n) = values
      self%n_integers = n
   end subroutine add_integers

   !> Append a text.
   pure subroutine add_text(self, name, text)
      class(small_values_type), intent(inout) :: self
      character(len=*), intent(in) :: name, text
      call self%add_line(name, small_kind%text, [len(text)])
      call append(self%texts, self%n_letters, text)
   end subroutine add_text

   !> Append a line of the index. A list of one number has no shape there.
   pure subroutine add_line(self, name, kind, shape)
      class(small_values_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: kind, shape(:)
      integer :: i
      call append(self%index, self%n_index, name//' '//trim(kind_names(kind)))
      if (size(shape) /= 1 .or. any(shape /= 1)) then
         do i = 1, size(shape)
            call append(self%index, self%n_index, ' '//to_string(shape(i)))
         end do
      end if
      call append(self%index, self%n_index, new_line('a'))
   end subroutine add_line

   !> Append letters to a text with room.
   pure subroutine append(text, n, more)
      character(len=:), allocatable, intent(inout) :: text   !! (>= n)
      integer, intent(inout) :: n
      character(len=*), intent(in) :: more
      character(len=:), allocatable :: larger
      integer :: m
      m = n + len(more)
      if (m > len(text)) then
         allocate (character(len=2*m + 4096) :: larger)
         larger(:n) = text(:n)
         call move_alloc(larger, text)
      end if
      text(n + 1:m) = more
      n = m
   end subroutine append

   !> Read the index, after all values are in place. .false. when it is no index of that number of values.
   logical function take_index(self) result(ok)
      class(small_values_type), intent(inout) :: self
      integer :: i, n, first, ends
      integer(i8) :: sums(3)
      n = 0
      do i = 1, self%n_index
         if (self%index(i:i) == new_line('a')) n = n + 1
      end do
      if (allocated(self%entries)) deallocate (self%entries)
      allocate (self%entries(n))
      ok = .true.
      sums = 0
      first = 1
      do i = 1, n
         ends = first + index(self%index(first:self%n_index), new_line('a')) - 2
         ok = self%is_entry(first, ends, self%entries(i))
         if (.not. ok) return
         associate (entry => self%entries(i))
            ! each sum is that of sizes below 2^31, and their number is below 2^31
            entry%before = int(min(sums(entry%kind), int(huge(1), i8)))
            sums(entry%kind) = sums(entry%kind) + entry%size
         end associate
         first = ends + 2
      end do
      ok = first == self%n_index + 1 .and. all(sums == [self%n_reals, self%n_integers, self%n_letters])
   end function take_index

   !> Take the line between two places of the index apart. .false. when it is none.
   logical function is_entry(self, first, last, entry)
      class(small_values_type), intent(in) :: self
      integer, intent(in) :: first, last
      type(small_entry_type), intent(out) :: entry
      integer, parameter :: most_words = 4
      integer :: starts(most_words), ends(most_words), i, k, n
      integer(i8) :: product_of
      is_entry = .false.
      n = 0
      i = first
      do while (i <= last)
         if (n == most_words) return
         k = index(self%index(i:last), ' ')
         n = n + 1
         starts(n) = i
         ends(n) = merge(last, i + k - 2, k == 0)
         i = ends(n) + 2
      end do
      if (n < 2) return
      entry%first = starts(1)
      entry%last = ends(1)
      do k = 1, size(kind_names)
         if (self%index(starts(2):ends(2)) == trim(kind_names(k))) entry%kind = k
      end do
      if (entry%kind == small_kind%none) return
      entry%rank = max(1, n - 2)
      product_of = 1
      do i = 3, n
         entry%shape(i - 2) = whole_number(self%index(starts(i):ends(i)))
         if (entry%shape(i - 2) < 0) return
         product_of = product_of*entry%shape(i - 2)
      end do
      if (product_of > huge(1)) return
      entry%size = int(product_of)
      is_entry = .true.
   end function is_entry

   !> A whole number of at most nine digits; -1 for anything else.
   pure integer function whole_number(text)
      character(len=*), intent(in) :: text
      integer :: i
      whole_number = -1
      if (len(text) < 1 .or. len(text) > 9 .or. verify(text, '0123456789') > 0) return
      whole_number = 0
      do i = 1, len(text)
         whole_number = 10*whole_number + ichar(text(i:i)) - ichar('0')
      end do
   end function whole_number

   !> The value of a name; of kind `none` when there is none. Names that follow one another are found at once.
   subroutine find(self, name, entry)
      class(small_values_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(small_entry_type), intent(out) :: entry
      integer :: i, k
      do i = 0, size(self%entries) - 1
         k = 1 + modulo(self%present - 1 + i, size(self%entries))
         if (self%index(self%entries(k)%first:self%entries(k)%last) /= name) cycle
         entry = self%entries(k)
         self%present = k
         return
      end do
   end subroutine find

end module rockdda_io_small_values
