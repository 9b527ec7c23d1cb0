! SPDX-License-Identifier: MIT
!> The files of a model that is named by its folder.
module rockdda_io_model_folder
   use rockdda_base_strings, only : to_string
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_posix, only : file_name_type, list_directory, path_kind, get_path_kind
   use rockdda_io_recognise, only : file_kind, recognise, kind_of_ending
   implicit none
   private
   public :: find_model_files

   !> Largest number of files of a kind that a message names.
   integer, parameter :: most_listed = 5

contains

   !> Find the labelled file of a folder: then there is no model and no analysis file, and it is `config`. Or find
   !> exactly one geometry or block file, one analysis file and at most one file of options. Only files with one of the
   !> known endings count; their content decides what they are.
   subroutine find_model_files(folder, model, analysis, config, unread, error)
      character(len=*), intent(in) :: folder
      character(len=:), allocatable, intent(out) :: model     !! path of the geometry or block file
      character(len=:), allocatable, intent(out) :: analysis  !! path of the analysis file
      character(len=:), allocatable, intent(out) :: config    !! path of the options; unallocated: none
      character(len=:), allocatable, intent(out) :: unread    !! names of options files that a labelled file leaves out
      type(error_type), allocatable, intent(out) :: error     !! code error_code%input
      type(error_type), allocatable :: unreadable
      type(file_name_type), allocatable :: names(:)
      character(len=:), allocatable :: prefix, path, models, analyses, configs, problem
      character(len=:), allocatable :: labelled, all_labelled
      integer :: i, kind, by_ending, n_models, n_analyses, n_configs, n_labelled
      logical :: ok

      prefix = trim(folder)//'/'
      if (index(folder, '/', back=.true.) == len_trim(folder)) prefix = trim(folder)
      if (get_path_kind(folder) /= path_kind%directory) then
         call make_error(error, error_code%input, trim(folder)//': error: is not a folder')
         return
      end if
      call list_directory(folder, names, ok)
      if (.not. ok) then
         call make_error(error, error_code%input, trim(folder)//': error: the folder cannot be read')
         return
      end if
      unread = ''
      n_models = 0; n_analyses = 0; n_configs = 0; n_labelled = 0
      models = ''; analyses = ''; configs = ''; all_labelled = ''; problem = ''
      do i = 1, size(names)
         if (names(i)%name(1:1) == '.') cycle
         by_ending = kind_of_ending(names(i)%name)
         if (by_ending == file_kind%unknown .or. by_ending == file_kind%hdf5 .or. &
             by_ending == file_kind%checkpoint) cycle
         path = prefix//names(i)%name
         if (get_path_kind(path) == path_kind%directory) cycle
         call recognise(path, kind, unreadable)
         if (allocated(unreadable)) kind = by_ending
         if (kind == file_kind%geometry .or. kind == file_kind%blocks) then
            call count_file(names(i)%name, path, n_models, models, model)
         else if (kind == file_kind%analysis) then
            call count_file(names(i)%name, path, n_analyses, analyses, analysis)
         else if (kind == file_kind%options) then
            call count_file(names(i)%name, path, n_configs, configs, config)
         else if (kind == file_kind%labelled) then
            call count_file(names(i)%name, path, n_labelled, all_labelled, labelled)
         else if (kind == file_kind%ddaml) then
            problem = problem//new_line('a')//'note: '//names(i)%name//' is a DDAML (XML) file; '// &
                      "convert it first with 'rockdda-post convert'"
         end if
      end do
      if (n_labelled == 1) then
         model = ''
         analysis = ''
         config = labelled
         unread = listed(n_configs, configs)
         return
      else if (n_labelled > 1) then
         call make_error(error, error_code%input, trim(folder)//': error: a model folder must hold at most one '// &
                         'labelled file (.nml with &model); found '//found(n_labelled, all_labelled, 'labelled')// &
                         ': name the one to take')
         return
      end if
      if (n_models == 1 .and. n_analyses == 1 .and. n_configs <= 1) return
      path = trim(folder)//': error: a model folder must hold exactly one geometry or block file '// &
             '(.dc, .geo, .blk), one analysis file (.df, .ana) and at most one options file (.nml), or a labelled '// &
             'file (.nml with &model); found '// &
             found(n_models, models, 'geometry or block')//', '//found(n_analyses, analyses, 'analysis')//', '// &
             found(n_configs, configs, 'options')
      call make_error(error, error_code%input, path//problem)
   end subroutine find_model_files

   !> Count one more file of a kind.
   pure subroutine count_file(name, path, n, list, place)
      character(len=*), intent(in) :: name, path
      integer, intent(inout) :: n
      character(len=:), allocatable, intent(inout) :: list, place
      n = n + 1
      place = path
      if (n > most_listed) return
      if (n > 1) list = list//', '
      list = list//name
   end subroutine count_file

   !> "2 analysis files (a.df, b.df)".
   pure function found(n, list, what) result(text)
      integer, intent(in) :: n
      character(len=*), intent(in) :: list, what
      character(len=:), allocatable :: text
      if (n == 0) then
         text = 'no '//what//' file'
      else if (n == 1) then
         text = '1 '//what//' file ('//list//')'
      else
         text = to_string(n)//' '//what//' files ('//listed(n, list)//')'
      end if
   end function found

   !> "a.df, b.df", "a.df, b.df, c.df, d.df, e.df and 7 more".
   pure function listed(n, list) result(text)
      integer, intent(in) :: n
      character(len=*), intent(in) :: list
      character(len=:), allocatable :: text
      text = list
      if (n > most_listed) text = text//' and '//to_string(n - most_listed)//' more'
   end function listed

end module rockdda_io_model_folder
