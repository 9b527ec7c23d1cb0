! SPDX-License-Identifier: MIT
!> Values written to an HDF5 file and read from it by the same call, each under its name:
!>
!>     call archive%section('state')
!>     call archive%item('time', state%time)           ! written to or read from state/time
!>     call archive%item('vertices', state%vertices)   ! allocated when read; missing: not allocated
!>
!> so that writer and reader cannot differ. Reals are restored bit by bit. After the first failure, kept in `error`, all
!> calls return at once. Small values are kept together (rockdda_io_small_values), larger ones are a dataset each.
module rockdda_io_archive
   use rockdda_base_kinds, only : wp, i1, i8, l1
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_state_archive, only : state_archive_type
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_small_values, only : small_values_type, small_entry_type, small_kind
   implicit none
   private
   public :: archive_type

   !> Values, or letters, beyond which a value is a dataset of its own.
   integer, parameter :: most_values = 128, most_letters = 200
   !> Group of the small values.
   character(len=*), parameter :: small_group = 'small'

   type, extends(state_archive_type) :: archive_type
      type(hdf5_file_type) :: file
      type(error_type), allocatable :: error           !! the first failure
      character(len=:), allocatable, private :: prefix !! 'state/'
      logical, private :: has_group = .false.          !! the present section is a group of the file
      type(small_values_type), private :: small
   contains
      procedure :: start
      procedure :: put_small_values
      procedure :: get_small_values
      procedure :: section
      procedure :: has_loaded
      procedure :: has_item
      procedure :: length
      procedure :: refuse
      procedure :: demand
      generic :: item => text_item, integer_rows_item
      generic :: part => integer_part, byte_part, real_part, logical_part
      procedure :: integer_item, real_item, logical_item, integers_item, reals_item, real_rows_item, logicals_item
      procedure :: fixed_reals, fixed_integers
      procedure, private :: text_item, integer_rows_item
      procedure, private :: integer_part, byte_part, real_part, logical_part
      procedure, private :: put_reals, put_integers, get_reals, get_integers, need_group
      procedure, private :: is_there, get_shape, has_rows, check_integers, check_reals
   end type archive_type

contains

   !> Begin without values and without a failure.
   subroutine start(self, saving)
      class(archive_type), intent(inout) :: self
      logical, intent(in) :: saving
      self%saving = saving
      if (allocated(self%error)) deallocate (self%error)
      call self%small%start()
   end subroutine start

   !> Write the small values, after all others.
   subroutine put_small_values(self)
      class(archive_type), intent(inout) :: self
      if (.not. allocated(self%error)) call self%file%create_group(small_group, self%error)
      associate (small => self%small)
         if (.not. allocated(self%error)) &
            call self%file%write(small_group//'/index', small%index(:small%n_index), self%error)
         if (.not. allocated(self%error)) call self%file%write(small_group//'/reals', [small%n_reals], &
                                                               small%reals(:small%n_reals), self%error)
         if (.not. allocated(self%error)) call self%file%write(small_group//'/integers', [small%n_integers], &
                                                               small%integers(:small%n_integers), self%error)
         if (.not. allocated(self%error)) &
            call self%file%write(small_group//'/texts', small%texts(:small%n_letters), self%error)
      end associate
   end subroutine put_small_values

   !> Read the small values, before all others.
   subroutine get_small_values(self)
      class(archive_type), intent(inout) :: self
      if (allocated(self%error)) return
      associate (small => self%small)
         call self%file%read(small_group//'/index', small%index, self%error)
         if (.not. allocated(self%error)) call self%file%read(small_group//'/reals', small%reals, self%error)
         if (.not. allocated(self%error)) call self%file%read(small_group//'/integers', small%integers, self%error)
         if (.not. allocated(self%error)) call self%file%read(small_group//'/texts', small%texts, self%error)
         if (allocated(self%error)) return
         small%n_index = len(small%index)
         small%n_reals = size(small%reals)
         small%n_integers = size(small%integers)
         small%n_letters = len(small%texts)
      end associate
      self%prefix = small_group//'/'
      if (.not. self%small%take_index()) call self%refuse('index', 'does not describe the small values')
   end subroutine get_small_values

   !> Begin a section: the group of the items that follow.
   subroutine section(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      self%prefix = name//'/'
      self%has_group = .false.
   end subroutine section

   !> Have all items so far been loaded?
   pure logical function has_loaded(self)
      class(archive_type), intent(in) :: self
      has_loaded = .not. (self%saving .or. allocated(self%error))
   end function has_loaded

   !> Make the group of the present section, before its first dataset is written.
   subroutine need_group(self)
      class(archive_type), intent(inout) :: self
      if (self%has_group .or. allocated(self%error)) return
      call self%file%create_group(self%prefix(:len(self%prefix) - 1), self%error)
      self%has_group = .true.
   end subroutine need_group

   !> Write reals.
   subroutine put_reals(self, name, shape, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: shape(:)
      real(wp), intent(in) :: values(:)      !! (product(shape))
      if (allocated(self%error)) return
      if (size(values) <= most_values) then
         call self%small%add_reals(self%prefix//name, shape, values)
         return
      end if
      call self%need_group()
      if (.not. allocated(self%error)) call self%file%write(self%prefix//name, shape, values, self%error)
   end subroutine put_reals

   !> Write integers.
   subroutine put_integers(self, name, shape, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: shape(:)
      integer, intent(in) :: values(:)       !! (product(shape))
      if (allocated(self%error)) return
      if (size(values) <= most_values) then
         call self%small%add_integers(self%prefix//name, shape, values)
         return
      end if
      call self%need_group()
      if (.not. allocated(self%error)) call self%file%write(self%prefix//name, shape, values, self%error)
   end subroutine put_integers

   !> Read reals.
   subroutine get_reals(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out) :: values(:)
      type(small_entry_type) :: entry
      if (allocated(self%error)) return
      call self%small%find(self%prefix//name, entry)
      if (entry%kind == small_kind%none) then
         call self%file%read(self%prefix//name, values, self%error)
      else if (entry%kind == small_kind%reals) then
         values = self%small%reals(entry%before + 1:entry%before + entry%size)
      else
         call self%refuse(name, 'holds no reals')
      end if
   end subroutine get_reals

   !> Read integers.
   subroutine get_integers(self, name, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(out) :: values(:)
      type(small_entry_type) :: entry
      if (allocated(self%error)) return
      call self%small%find(self%prefix//name, entry)
      if (entry%kind == small_kind%none) then
         call self%file%read(self%prefix//name, values, self%error)
      else if (entry%kind == small_kind%integers) then
         values = self%small%integers(entry%before + 1:entry%before + entry%size)
      else
         call self%refuse(name, 'holds no integers')
      end if
   end subroutine get_integers

   !> Save or load a whole number.
   subroutine integer_item(self, name, value, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: value
      integer, intent(in), optional :: least, most
      integer :: values(1)
      values = value
      call self%fixed(name, values, least, most)
      value = values(1)
   end subroutine integer_item

   !> Save or load a real.
   subroutine real_item(self, name, value, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      real(wp), intent(in), optional :: least, most
      real(wp) :: values(1)
      values = value
      call self%fixed(name, values, least, most)
      value = values(1)
   end subroutine real_item

   !> Save or load a logical, stored as 0 or 1.
   subroutine logical_item(self, name, value)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: value
      integer :: values(1)
      values = merge(1, 0, value)
      call self%fixed(name, values, 0, 1)
      value = values(1) /= 0
   end subroutine logical_item

   !> Save or load a text.
   subroutine text_item(self, name, text, required)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(inout) :: text
      logical, intent(in), optional :: required            !! it must be in the file
      type(small_entry_type) :: entry
      if (allocated(self%error)) return
      if (self%saving) then
         if (allocated(text)) call put_text(self, name, text)
         return
      end if
      if (allocated(text)) deallocate (text)
      call self%small%find(self%prefix//name, entry)
      if (entry%kind == small_kind%text) then
         text = self%small%texts(entry%before + 1:entry%before + entry%size)
      else if (entry%kind /= small_kind%none) then
         call self%refuse(name, 'holds no text')
      else if (self%file%exists(self%prefix//name)) then
         call self%file%read(self%prefix//name, text, self%error)
      else if (present(required)) then
         if (required) call self%refuse(name, 'is missing')
      end if
   end subroutine text_item

   !> Write a text. Those of the input files are datasets always, because their digests are attributes of them; a text
   !> in HDF5 ends with a null.
   subroutine put_text(self, name, text)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name, text
      if (len(text) <= most_letters .and. self%prefix /= 'input/' .and. index(text, achar(0)) == 0) then
         call self%small%add_text(self%prefix//name, text)
         return
      end if
      call self%need_group()
      if (.not. allocated(self%error)) call self%file%write(self%prefix//name, text, self%error)
   end subroutine put_text

   !> Save or load a list of integers whose size in the file must be that of `values`.
   subroutine fixed_integers(self, name, values, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: values(:)
      integer, intent(in), optional :: least, most
      integer, allocatable :: found(:)
      if (allocated(self%error)) return
      if (self%saving) then
         call self%put_integers(name, [size(values)], values)
         return
      end if
      call self%get_integers(name, found)
      call self%check_integers(name, found, size(values), least, most)
      if (.not. allocated(self%error)) values = found
   end subroutine fixed_integers

   !> Save or load a list of reals whose size in the file must be that of `values`.
   subroutine fixed_reals(self, name, values, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:)
      real(wp), intent(in), optional :: least, most
      real(wp), allocatable :: found(:)
      if (allocated(self%error)) return
      if (self%saving) then
         call self%put_reals(name, [size(values)], values)
         return
      end if
      call self%get_reals(name, found)
      call self%check_reals(name, found, size(values), least, most)
      if (.not. allocated(self%error)) values = found
   end subroutine fixed_reals

   !> Save or load a list of integers.
   subroutine integers_item(self, name, values, n, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: values(:)
      integer, intent(in), optional :: n, least, most
      if (self%saving) then
         if (allocated(values)) call self%fixed(name, values)
      else if (.not. allocated(self%error)) then
         if (allocated(values)) deallocate (values)
         if (.not. self%has_item(name, present(n))) return
         call self%get_integers(name, values)
         call self%check_integers(name, values, n, least, most)
      end if
   end subroutine integers_item

   !> Save or load a list of reals.
   subroutine reals_item(self, name, values, n, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: values(:)
      integer, intent(in), optional :: n
      real(wp), intent(in), optional :: least, most
      if (self%saving) then
         if (allocated(values)) call self%fixed(name, values)
      else if (.not. allocated(self%error)) then
         if (allocated(values)) deallocate (values)
         if (.not. self%has_item(name, present(n))) return
         call self%get_reals(name, values)
         call self%check_reals(name, values, n, least, most)
      end if
   end subroutine reals_item

   !> Save or load a table of integers.
   subroutine integer_rows_item(self, name, values, known, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: values(:, :)
      integer, intent(in), optional :: known(2), least, most
      integer, allocatable :: list(:)
      integer :: n(2)
      if (allocated(self%error)) return
      if (self%saving) then
         if (allocated(values)) call self%put_integers(name, shape(values), reshape(values, [size(values)]))
         return
      end if
      if (allocated(values)) deallocate (values)
      if (.not. self%has_rows(name, n, known)) return
      call self%get_integers(name, list)
      call self%check_integers(name, list, least=least, most=most)
      if (.not. allocated(self%error)) values = reshape(list, n)
   end subroutine integer_rows_item

   !> Save or load a table of reals.
   subroutine real_rows_item(self, name, values, known, largest)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: values(:, :)
      integer, intent(in), optional :: known(2)
      real(wp), intent(in), optional :: largest
      real(wp), allocatable :: list(:)
      real(wp) :: most
      integer :: n(2)
      if (allocated(self%error)) return
      if (self%saving) then
         if (allocated(values)) call self%put_reals(name, shape(values), reshape(values, [size(values)]))
         return
      end if
      if (allocated(values)) deallocate (values)
      if (.not. self%has_rows(name, n, known)) return
      call self%get_reals(name, list)
      most = huge(most)
      if (present(largest)) most = largest
      call self%check_reals(name, list, least=-most, most=most)
      if (.not. allocated(self%error)) values = reshape(list, n)
   end subroutine real_rows_item

   !> Save or load a list of logicals.
   subroutine logicals_item(self, name, values, n)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, allocatable, intent(inout) :: values(:)
      integer, intent(in), optional :: n
      integer, allocatable :: numbers(:)
      if (self%saving .and. allocated(values)) then
         allocate (numbers(size(values)))
         numbers(:) = merge(1, 0, values)
      end if
      call self%item(name, numbers, n, 0, 1)
      if (self%saving) return
      if (allocated(values)) deallocate (values)
      if (allocated(numbers)) values = numbers /= 0
   end subroutine logicals_item

   !> Save or load the first n entries of an allocated list.
   subroutine integer_part(self, name, n, values, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      integer, allocatable, intent(inout) :: values(:)
      integer, intent(in) :: least, most
      call self%fixed(name, values(1:n), least, most)
   end subroutine integer_part

   !> Save or load the first n entries of an allocated list of reals.
   subroutine real_part(self, name, n, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      real(wp), allocatable, intent(inout) :: values(:)
      call self%fixed(name, values(1:n))
   end subroutine real_part

   !> Save or load the first n entries of an allocated list of small integers.
   subroutine byte_part(self, name, n, values, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      integer(i1), allocatable, intent(inout) :: values(:)
      integer, intent(in) :: least, most
      integer, allocatable :: numbers(:)
      allocate (numbers(n))
      numbers(:) = values(1:n)
      call self%fixed(name, numbers, least, most)
      if (.not. allocated(self%error)) values(1:n) = int(numbers, i1)
   end subroutine byte_part

   !> Save or load the first n entries of an allocated list of logicals.
   subroutine logical_part(self, name, n, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      logical(l1), allocatable, intent(inout) :: values(:)
      integer, allocatable :: numbers(:)
      allocate (numbers(n))
      numbers(:) = merge(1, 0, values(1:n))
      call self%fixed(name, numbers, 0, 1)
      values(1:n) = numbers /= 0
   end subroutine logical_part

   !> Refuse integers of another number than n, or beyond bounds.
   subroutine check_integers(self, name, values, n, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(in) :: values(:)
      integer, intent(in), optional :: n, least, most
      if (allocated(self%error)) return
      if (present(n)) then
         if (size(values) /= n) call self%refuse(name, 'has an unexpected shape')
      end if
      if (present(least)) call self%demand(all(values >= least), name)
      if (present(most)) call self%demand(all(values <= most), name)
   end subroutine check_integers

   !> Refuse reals of another number than n, that are not finite, or beyond bounds.
   subroutine check_reals(self, name, values, n, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(in) :: values(:)
      integer, intent(in), optional :: n
      real(wp), intent(in), optional :: least, most
      if (allocated(self%error)) return
      if (present(n)) then
         if (size(values) /= n) call self%refuse(name, 'has an unexpected shape')
      end if
      if (.not. all(abs(values) <= huge(1.0_wp))) call self%refuse(name, 'holds a number that is not finite')
      if (present(least)) call self%demand(all(values >= least), name)
      if (present(most)) call self%demand(all(values <= most), name)
   end subroutine check_reals

   !> Does the file contain this item?
   logical function is_there(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(small_entry_type) :: entry
      call self%small%find(self%prefix//name, entry)
      is_there = entry%kind /= small_kind%none
      if (.not. is_there) is_there = self%file%exists(self%prefix//name)
   end function is_there

   !> Shape of an item that is there, in Fortran order.
   subroutine get_shape(self, name, shape)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable, intent(out) :: shape(:)
      type(small_entry_type) :: entry
      call self%small%find(self%prefix//name, entry)
      if (entry%kind == small_kind%none) then
         call self%file%get_shape(self%prefix//name, shape, self%error)
      else
         shape = int(entry%shape(:entry%rank), i8)
      end if
   end subroutine get_shape

   !> Does the file contain this table, as it must where its shape is known? An error for what is no table.
   logical function has_rows(self, name, n, known)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(out) :: n(2)                   !! its shape
      integer, intent(in), optional :: known(2)      !! any second one where that is negative
      integer(i8), allocatable :: found(:)
      n = 0
      has_rows = self%has_item(name, present(known))
      if (.not. has_rows) return
      call self%get_shape(name, found)
      has_rows = .not. allocated(self%error)
      if (has_rows) has_rows = size(found) == 2
      if (has_rows .and. present(known)) has_rows = found(1) == known(1) .and. (known(2) < 0 .or. found(2) == known(2))
      if (has_rows) n = int(found)
      if (.not. has_rows) call self%refuse(name, 'has an unexpected shape')
   end function has_rows

   !> Does the present section contain this item, as it must where it is required? For loading.
   logical function has_item(self, name, required)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in), optional :: required
      has_item = .false.
      if (.not. allocated(self%error)) has_item = self%is_there(name)
      if (has_item .or. .not. present(required)) return
      if (required) call self%refuse(name, 'is missing')
   end function has_item

   !> Number of values of a list or rows of a table; -1 when it is missing. For loading.
   integer(i8) function length(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable :: shape_there(:)
      length = -1
      if (.not. self%has_item(name)) return
      call self%get_shape(name, shape_there)
      if (allocated(self%error)) return
      if (size(shape_there) > 0) length = shape_there(size(shape_there))
   end function length

   !> End loading with an error about a value of the present section.
   subroutine refuse(self, name, what)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: what          !! 'holds an impossible number'
      if (allocated(self%error)) return
      call make_error(self%error, error_code%input, self%file%path//': the checkpoint is damaged: '// &
                      self%prefix//name//' '//what)
   end subroutine refuse

   !> Refuse a value of the present section that was loaded, unless it can be.
   subroutine demand(self, ok, name)
      class(archive_type), intent(inout) :: self
      logical, intent(in) :: ok
      character(len=*), intent(in) :: name
      if (.not. (ok .or. self%saving)) call self%refuse(name, 'holds an impossible number')
   end subroutine demand

end module rockdda_io_archive
