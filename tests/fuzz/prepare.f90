! SPDX-License-Identifier: MIT
!> Files that the program itself makes of the models: blocks, results, checkpoints.
module fuzz_prepare
   use fuzz_corpus, only : corpus_type, set_type, set_kind
   use fuzz_system, only : fork_child, limit_child, wait_for_child, leave, enter_folder, make_folder, clear_folder, &
                           read_text, write_text
   use fuzz_trial, only : limits_type
   use rockdda_io_posix, only : file_name_type, list_directory
   use rockdda_app_process, only : argument_type, start_process, end_process
   use rockdda_app_program, only : run_program
   implicit none
   private
   public :: add_made_files

contains

   !> Cut every model, and run the small ones for a few steps. ok is false when nothing comes of that.
   subroutine add_made_files(corpus, folder, limits, ok)
      type(corpus_type), intent(inout) :: corpus
      character(len=*), intent(in) :: folder
      type(limits_type), intent(in) :: limits
      logical, intent(out) :: ok
      type(set_type) :: set
      integer :: i, n, n_cut, n_run
      call make_folder(folder)
      n = corpus%n
      n_cut = 0
      n_run = 0
      do i = 1, n
         if (corpus%sets(i)%kind /= set_kind%model) cycle
         call make(corpus%sets(i), folder, limits)
         set = corpus%sets(i)
         set%weight = 1
         set%files(1)%name = 'out.blk'
         set%files(1)%text = read_text(folder//'/out.blk')
         if (len(set%files(1)%text) > 0) then
            set%files(1)%name = 'blocks.blk'
            call corpus%add(set)
            n_cut = n_cut + 1
         end if
         ! results of one model look like those of another
         if (n_run >= 4 .or. len(set%files(1)%text) > 4000) cycle
         call collect_results(folder, set)
         if (set%n == 0) cycle
         call corpus%add(set)
         n_run = n_run + 1
      end do
      call clear_folder(folder)
      ok = n_cut > 10 .and. n_run == 4
   end subroutine add_made_files

   !> Cut and run a model in a child.
   subroutine make(set, folder, limits)
      type(set_type), intent(in) :: set
      character(len=*), intent(in) :: folder
      type(limits_type), intent(in) :: limits
      type(argument_type) :: arguments(12)
      character(len=20) :: words(10)
      integer :: i, child, code
      logical :: ok
      call clear_folder(folder)
      do i = 1, set%n
         call write_text(folder//'/'//set%files(i)%name, set%files(i)%text)
      end do
      child = fork_child()
      if (child == 0) then
         call limit_child(folder//'/output.txt', limits%seconds, 6*limits%seconds, limits%megabytes)
         call enter_folder(folder, ok)
         call start_process()
         words(1:3) = [character(len=20) :: 'cut', '-o', 'out.blk']
         do i = 1, 3
            arguments(i)%text = trim(words(i))
         end do
         arguments(4)%text = set%files(1)%name
         call run_program(arguments(1:4), code)
         ! time is up after some steps, or before the first: a checkpoint is left
         words(1:8) = [character(len=20) :: 'run', '-o', 'run.h5', '--force', '--quiet', '--json', &
                       '--max-wall=0.05', '--']
         do i = 1, 8
            arguments(i)%text = trim(words(i))
         end do
         arguments(9)%text = set%files(1)%name
         arguments(10)%text = set%files(2)%name
         call run_program(arguments(1:10), code)
         call end_process(0)
         call leave(1)
      end if
      if (child > 0) code = wait_for_child(child)
   end subroutine make

   !> The HDF5 files of the run.
   subroutine collect_results(folder, set)
      character(len=*), intent(in) :: folder
      type(set_type), intent(out) :: set
      type(file_name_type), allocatable :: names(:)
      integer :: i
      logical :: ok
      set%kind = set_kind%results
      call list_directory(folder, names, ok)
      allocate (set%files(size(names)))
      do i = 1, size(names)
         if (index(names(i)%name, '.h5', back=.true.) /= len(names(i)%name) - 2) cycle
         set%n = set%n + 1
         set%files(set%n)%name = names(i)%name
         set%files(set%n)%text = read_text(folder//'/'//names(i)%name)
      end do
      set%weight = 3
   end subroutine collect_results

end module fuzz_prepare
