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
   use rockdda_base_kinds, only : wp, i8
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
      procedure :: length
      procedure :: refuse
      procedure :: demand
      procedure :: exchange
      generic :: item => text_item
      procedure, private :: text_item, put_numbers, get_numbers, need_group, find
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
      call self%file%create_group(small_group, self%error)
      associate (small => self%small)
         call self%file%write(small_group//'/index', small%index(:small%n_index), self%error)
         call self%file%write(small_group//'/reals', [small%n_reals], small%reals(:small%n_reals), self%error)
         call self%file%write(small_group//'/integers', [small%n_integers], small%integers(:small%n_integers), &
                              self%error)
         call self%file%write(small_group//'/texts', small%texts(:small%n_letters), self%error)
      end associate
   end subroutine put_small_values

   !> Read the small values, before all others.
   subroutine get_small_values(self)
      class(archive_type), intent(inout) :: self
      if (allocated(self%error)) return
      associate (small => self%small)
         call self%file%read(small_group//'/index', small%index, self%error)
         call self%file%read(small_group//'/reals', small%reals, self%error)
         call self%file%read(small_group//'/integers', small%integers, self%error)
         call self%file%read(small_group//'/texts', small%texts, self%error)
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

   !> Save or load numbers, and check what was loaded.
   subroutine exchange(self, name, is_real, required, shape, values, least, most)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: is_real, required
      integer, intent(inout) :: shape(:)
      real(wp), allocatable, intent(inout) :: values(:)
      real(wp), intent(in) :: least, most
      type(small_entry_type) :: entry
      integer, allocatable :: found(:)
      logical :: fits
      if (self%saving) then
         if (allocated(values) .and. .not. allocated(self%error)) call self%put_numbers(name, is_real, shape, values)
         return
      end if
      if (allocated(values)) deallocate (values)
      if (allocated(self%error)) return
      call self%find(name, entry, found)
      if (allocated(self%error)) return
      if (size(found) == 0) then
         if (required) call self%refuse(name, 'is missing')
         return
      end if
      fits = size(found) == size(shape)
      if (fits) fits = all(shape < 0 .or. found == shape)
      if (.not. fits) then
         call self%refuse(name, 'has an unexpected shape')
         return
      end if
      shape = found
      call self%get_numbers(name, entry, is_real, values)
      if (allocated(self%error)) return
      if (.not. all(abs(values) <= huge(1.0_wp))) call self%refuse(name, 'holds a number that is not finite')
      call self%demand(all(values >= least) .and. all(values <= most), name)
   end subroutine exchange

   !> Write numbers.
   subroutine put_numbers(self, name, is_real, shape, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: is_real
      integer, intent(in) :: shape(:)
      real(wp), intent(in) :: values(:)      !! (product(shape))
      if (size(values) <= most_values) then
         if (is_real) call self%small%add_reals(self%prefix//name, shape, values)
         if (.not. is_real) call self%small%add_integers(self%prefix//name, shape, nint(values))
         return
      end if
      call self%need_group()
      if (allocated(self%error)) return
      if (is_real) call self%file%write(self%prefix//name, shape, values, self%error)
      if (.not. is_real) call self%file%write(self%prefix//name, shape, nint(values), self%error)
   end subroutine put_numbers

   !> Read numbers that are there.
   subroutine get_numbers(self, name, entry, is_real, values)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(small_entry_type), intent(in) :: entry
      logical, intent(in) :: is_real
      real(wp), allocatable, intent(out) :: values(:)
      integer, allocatable :: integers(:)
      associate (first => entry%before + 1, last => entry%before + entry%size)
         if (entry%kind == small_kind%none .and. is_real) then
            call self%file%read(self%prefix//name, values, self%error)
         else if (entry%kind == small_kind%none) then
            call self%file%read(self%prefix//name, integers, self%error)
            if (.not. allocated(self%error)) values = real(integers, wp)
         else if (entry%kind /= merge(small_kind%reals, small_kind%integers, is_real)) then
            call self%refuse(name, 'holds no '//trim(merge('reals   ', 'integers', is_real)))
         else if (is_real) then
            values = self%small%reals(first:last)
         else
            values = real(self%small%integers(first:last), wp)
         end if
      end associate
   end subroutine get_numbers

   !> Find an item: its entry when it is a small one, and its shape in Fortran order, of size 0 when it is missing.
   subroutine find(self, name, entry, shape)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(small_entry_type), intent(out) :: entry
      integer, allocatable, intent(out) :: shape(:)
      integer(i8), allocatable :: long(:)
      call self%small%find(self%prefix//name, entry)
      if (entry%kind /= small_kind%none) then
         shape = entry%shape(:entry%rank)
      else if (self%file%exists(self%prefix//name)) then
         call self%file%get_shape(self%prefix//name, long, self%error)
         if (.not. allocated(self%error)) shape = int(min(long, int(huge(1), i8)))
      end if
      if (.not. allocated(shape)) allocate (shape(0))
   end subroutine find

   !> Number of values of a list or rows of a table; -1 when it is missing. For loading.
   integer function length(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(small_entry_type) :: entry
      integer, allocatable :: shape(:)
      length = -1
      if (allocated(self%error)) return
      call self%find(name, entry, shape)
      if (size(shape) > 0) length = shape(size(shape))
   end function length

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
      call self%file%write(self%prefix//name, text, self%error)
   end subroutine put_text

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
