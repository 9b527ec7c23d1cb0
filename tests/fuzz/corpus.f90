! SPDX-License-Identifier: MIT
!> The files that are to be spoiled, in sets that belong together.
module fuzz_corpus
   use fuzz_random, only : random_type
   use fuzz_system, only : read_text
   use rockdda_io_posix, only : file_name_type, list_directory, get_path_kind, path_kind
   implicit none
   private
   public :: file_type, set_type, corpus_type, set_kind

   type :: file_type
      character(len=:), allocatable :: name    !! without folders
      character(len=:), allocatable :: text
   end type file_type

   type :: set_kind_enum
      integer :: model = 1        !! geometry or blocks, analysis, perhaps options, perhaps tables
      integer :: single = 2       !! one file of some kind
      integer :: results = 3      !! HDF5 files of one run
      integer :: labelled = 4     !! geometry or blocks, a labelled file
   end type set_kind_enum
   type(set_kind_enum), parameter :: set_kind = set_kind_enum()

   type :: set_type
      integer :: kind = 0                           !! one of set_kind%...
      type(file_type), allocatable :: files(:)      !! a model: geometry or blocks first, analysis second
      integer :: n = 0
      integer :: config = 0                         !! place of the options among the files, 0: none
      double precision :: weight = 1
   end type set_type

   type :: corpus_type
      integer :: n = 0
      type(set_type), allocatable :: sets(:)
      double precision :: share_of_holes = 0.05d0   !! of inputs that are drawn: blocks with many holes
   contains
      procedure :: add
      procedure :: add_folder
      procedure :: add_singles
      procedure :: add_labelled
      procedure :: keep_kind
      procedure :: pick
      procedure :: any_text
   end type corpus_type

contains

   !> Add a set. Small ones come more often: they cost less, and every byte of them matters more.
   subroutine add(self, set)
      class(corpus_type), intent(inout) :: self
      type(set_type), intent(in) :: set
      type(set_type), allocatable :: larger(:)
      integer :: i, length
      if (.not. allocated(self%sets)) allocate (self%sets(16))
      if (self%n == size(self%sets)) then
         allocate (larger(2*self%n))
         do i = 1, self%n
            larger(i) = self%sets(i)
         end do
         call move_alloc(larger, self%sets)
      end if
      self%n = self%n + 1
      self%sets(self%n) = set
      length = 0
      do i = 1, set%n
         length = length + len(set%files(i)%text)
      end do
      if (set%kind /= set_kind%results) self%sets(self%n)%weight = set%weight/(1 + length/2000d0)
   end subroutine add

   !> Add the models of a folder: each geometry or block file with the analysis file of its name, and with the
   !> options and tables of the folder. A geometry without analysis is a set of its own, and so is any DDAML file.
   subroutine add_folder(self, folder)
      class(corpus_type), intent(inout) :: self
      character(len=*), intent(in) :: folder
      type(file_name_type), allocatable :: names(:)
      type(set_type) :: set
      character(len=:), allocatable :: stem
      integer :: i, k
      logical :: ok
      call list_directory(folder, names, ok)
      if (.not. ok) return
      do i = 1, size(names)
         if (.not. has_ending(names(i)%name, ' .dc .geo .blk ')) cycle
         call begin_set(set, size(names))
         set%kind = set_kind%single
         call put(set, folder, names(i)%name)
         stem = names(i)%name(1:index(names(i)%name, '.', back=.true.) - 1)
         do k = 1, size(names)
            if (names(k)%name /= stem//'.df' .and. names(k)%name /= stem//'.ana') cycle
            call put(set, folder, names(k)%name)
            set%kind = set_kind%model
            exit
         end do
         if (set%kind == set_kind%model) then
            do k = 1, size(names)
               if (has_ending(names(k)%name, ' .nml ')) then
                  call put(set, folder, names(k)%name)
                  set%config = set%n
               end if
            end do
            ! only options refer to tables
            do k = 1, size(names)
               if (set%config > 0 .and. has_ending(names(k)%name, ' .csv ')) call put(set, folder, names(k)%name)
            end do
         end if
         call self%add(set)
      end do
      do i = 1, size(names)
         if (.not. has_ending(names(i)%name, ' .dl ')) cycle
         call begin_set(set, 1)
         set%kind = set_kind%single
         call put(set, folder, names(i)%name)
         call self%add(set)
      end do
   end subroutine add_folder

   !> Add the labelled file of a folder, with the geometry or block file and the tables beside it.
   subroutine add_labelled(self, folder)
      class(corpus_type), intent(inout) :: self
      character(len=*), intent(in) :: folder
      type(file_name_type), allocatable :: names(:)
      type(set_type) :: set
      integer :: i
      logical :: ok
      call list_directory(folder, names, ok)
      if (.not. ok) return
      call begin_set(set, size(names))
      set%kind = set_kind%labelled
      do i = 1, size(names)
         if (has_ending(names(i)%name, ' .nml ')) call put(set, folder, names(i)%name)
      end do
      if (set%n /= 1) return
      if (index(set%files(1)%text, '&model') == 0) return
      do i = 1, size(names)
         if (has_ending(names(i)%name, ' .dc .geo .blk .df .ana .csv .at2 ')) call put(set, folder, names(i)%name)
      end do
      set%weight = 4
      call self%add(set)
   end subroutine add_labelled

   !> Drop all sets but those of a kind.
   subroutine keep_kind(self, kind)
      class(corpus_type), intent(inout) :: self
      integer, intent(in) :: kind                  !! one of set_kind%...
      integer :: i, n
      n = 0
      do i = 1, self%n
         if (self%sets(i)%kind /= kind) cycle
         n = n + 1
         if (n < i) self%sets(n) = self%sets(i)
      end do
      self%n = n
   end subroutine keep_kind

   !> Add every file of a folder as a set of its own.
   subroutine add_singles(self, folder)
      class(corpus_type), intent(inout) :: self
      character(len=*), intent(in) :: folder
      type(file_name_type), allocatable :: names(:)
      type(set_type) :: set
      integer :: i
      logical :: ok
      call list_directory(folder, names, ok)
      if (.not. ok) return
      do i = 1, size(names)
         if (has_ending(names(i)%name, ' .expected .txt ')) cycle
         if (get_path_kind(folder//'/'//names(i)%name) /= path_kind%file) cycle
         call begin_set(set, 1)
         set%kind = set_kind%single
         set%weight = 0.25d0
         call put(set, folder, names(i)%name)
         call self%add(set)
      end do
   end subroutine add_singles

   !> Some set.
   integer function pick(self, random)
      class(corpus_type), intent(in) :: self
      type(random_type), intent(inout) :: random
      double precision :: left
      left = random%unit()*sum(self%sets(1:self%n)%weight)
      do pick = 1, self%n - 1
         left = left - self%sets(pick)%weight
         if (left < 0) exit
      end do
      pick = min(pick, self%n)
   end function pick

   !> Text of some file.
   function any_text(self, random) result(text)
      class(corpus_type), intent(in) :: self
      type(random_type), intent(inout) :: random
      character(len=:), allocatable :: text
      integer :: i
      i = self%pick(random)
      text = self%sets(i)%files(1 + random%below(self%sets(i)%n))%text
   end function any_text

   !> An empty set with room.
   subroutine begin_set(set, room)
      type(set_type), intent(out) :: set
      integer, intent(in) :: room
      allocate (set%files(room))
   end subroutine begin_set

   !> One more file of a set.
   subroutine put(set, folder, name)
      type(set_type), intent(inout) :: set
      character(len=*), intent(in) :: folder, name
      set%n = set%n + 1
      set%files(set%n)%name = name
      set%files(set%n)%text = read_text(folder//'/'//name)
   end subroutine put

   !> Does a name end in one of these, between blanks?
   pure logical function has_ending(name, endings)
      character(len=*), intent(in) :: name, endings
      integer :: dot
      dot = index(name, '.', back=.true.)
      has_ending = .false.
      if (dot > 0) has_ending = index(endings, ' '//name(dot:)//' ') > 0
   end function has_ending

end module fuzz_corpus
