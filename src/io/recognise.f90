! SPDX-License-Identifier: MIT
!> What kind of file is this? By content first, by ending second.
!>
!> The files of a model that is named by its folder.
module rockdda_io_recognise
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_io_block_file, only : block_file_magic
   use rockdda_io_checkpoint, only : is_checkpoint, results_path
   use rockdda_io_counting, only : fits_geometry, fits_analysis
   use rockdda_io_namelist_parser, only : namelist_type, parse_namelist
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : all_options
   use rockdda_io_windows_block_file, only : fits_windows_blocks
   use rockdda_io_posix, only : get_file_size, file_name_type, list_directory, path_kind, get_path_kind
   use rockdda_lines_statistics_options, only : all_statistics
   use rockdda_io_source, only : source_type, read_source, file_text_problem, begins_as_xml
   use rockdda_io_tokens, only : token_list_type, token_kind, tokenise
   implicit none
   private
   public :: file_kind, recognise, kind_name, kind_of_ending, ddaml_advice, find_model_files

   type :: file_kind_enum
      integer :: unknown = 0
      integer :: geometry = 1     !! .dc, .geo
      integer :: analysis = 2     !! .df, .ana
      integer :: blocks = 3       !! .blk, of RockDDA or DDA for Windows
      integer :: options = 4      !! .nml
      integer :: statistics = 5   !! .dl, joint statistics
      integer :: ddaml = 6        !! XML of DDA for Windows: rockdda-post convert
      integer :: hdf5 = 7         !! results
      integer :: checkpoint = 8   !! of a run
      integer :: labelled = 9     !! .nml with &model
   end type file_kind_enum
   type(file_kind_enum), parameter :: file_kind = file_kind_enum()
   !> What to do with a file of DDA for Windows.
   character(len=*), parameter :: ddaml_advice = &
      "this is a DDAML (XML) file; convert it first with 'rockdda-post convert'"

   !> Largest number of files of a kind that a message names.
   integer, parameter :: most_listed = 5

contains

   !> Find the kind of a file. An error only when the file cannot be read as one or its kind cannot be determined.
   subroutine recognise(path, kind, error)
      character(len=*), intent(in) :: path
      integer, intent(out) :: kind                          !! one of file_kind%...
      type(error_type), allocatable, intent(out) :: error   !! code error_code%input
      type(source_type) :: source
      type(diagnostics_type) :: messages
      character(len=:), allocatable :: problem
      logical :: ok
      kind = file_kind%unknown
      problem = file_text_problem(path, any_size=.true.)
      if (len(problem) > 0) then
         call make_error(error, error_code%input, trim(path)//': error: '//problem)
         return
      end if
      if (is_hdf5(path)) then
         kind = merge(file_kind%checkpoint, file_kind%hdf5, is_checkpoint(path))
         return
      end if
      ! a damaged checkpoint has no signature of HDF5
      if (kind_of_ending(path) == file_kind%checkpoint) then
         kind = file_kind%checkpoint
         return
      end if
      call read_source(path, source, messages, ok)
      if (ok) then
         kind = kind_of_text(source)
      else if (allocated(source%text)) then
         if (begins_as_xml(source%text)) kind = file_kind%ddaml
      end if
      if (kind /= file_kind%unknown) return
      if (.not. ok) then
         call messages%to_error(error)
         return
      end if
      kind = kind_of_ending(path)
      if (kind == file_kind%unknown) call make_error(error, error_code%input, trim(path)// &
         ': error: neither content nor ending (.dc, .geo, .df, .ana, .blk, .nml, .dl, .h5) shows what kind of '// &
         'file this is')
   end subroutine recognise

   !> Kind by content; unknown when no kind fits, or several do.
   function kind_of_text(source) result(kind)
      type(source_type), intent(in) :: source
      integer :: kind
      type(token_list_type) :: tokens
      integer :: n_fit
      character(len=:), allocatable :: first
      kind = file_kind%unknown
      call tokenise(source, tokens)
      if (tokens%n == 0) return
      first = tokens%text(1)
      if (first == block_file_magic) then
         kind = file_kind%blocks
      else if (first(1:1) == '&' .or. first(1:1) == '$') then
         kind = kind_of_namelist(source)
      else if (tokens%kind(1) /= token_kind%text) then
         n_fit = 0
         if (fits_windows_blocks(tokens)) call fits(file_kind%blocks)
         if (fits_geometry(tokens)) call fits(file_kind%geometry)
         if (fits_analysis(tokens)) call fits(file_kind%analysis)
         if (n_fit > 1) kind = file_kind%unknown
      end if

   contains

      !> Note one more kind that fits.
      subroutine fits(this)
         integer, intent(in) :: this
         n_fit = n_fit + 1
         kind = this
      end subroutine fits

   end function kind_of_text

   !> Options or joint statistics, by the names of the groups.
   function kind_of_namelist(source) result(kind)
      type(source_type), intent(in) :: source
      integer :: kind
      type(namelist_type) :: namelist
      type(option_rows_type) :: known, known_statistics
      integer :: i, n_options, n_statistics
      call parse_namelist(source, namelist)
      known = all_options()
      known_statistics = all_statistics()
      n_options = 0
      n_statistics = 0
      do i = 1, namelist%n
         if (any(known%group_names() == namelist%groups(i)%name)) n_options = n_options + 1
         if (any(known_statistics%group_names() == namelist%groups(i)%name)) n_statistics = n_statistics + 1
      end do
      kind = file_kind%unknown
      if (n_options > n_statistics) kind = file_kind%options
      if (kind == file_kind%options .and. any([(namelist%groups(i)%name == 'model', i=1, namelist%n)])) &
         kind = file_kind%labelled
      if (n_statistics > n_options) kind = file_kind%statistics
   end function kind_of_namelist

   !> Kind by the ending of the name.
   pure integer function kind_of_ending(path)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: name
      integer :: i
      name = lower_case(trim(path))
      i = index(name, '.', back=.true.)
      kind_of_ending = file_kind%unknown
      if (i == 0 .or. i < index(name, '/', back=.true.)) return
      if (len(results_path(name, '')) > 0) then
         kind_of_ending = file_kind%checkpoint
         return
      end if
      select case (name(i:))
      case ('.dc', '.geo'); kind_of_ending = file_kind%geometry
      case ('.df', '.ana'); kind_of_ending = file_kind%analysis
      case ('.blk'); kind_of_ending = file_kind%blocks
      case ('.nml'); kind_of_ending = file_kind%options
      case ('.dl'); kind_of_ending = file_kind%statistics
      case ('.h5', '.hdf5'); kind_of_ending = file_kind%hdf5
      end select
   end function kind_of_ending

   !> A kind in words.
   pure function kind_name(kind) result(name)
      integer, intent(in) :: kind           !! one of file_kind%...
      character(len=:), allocatable :: name
      character(len=*), parameter :: names(0:9) = [character(len=24) :: 'unknown file', 'geometry file', &
         'analysis file', 'block file', 'options file', 'joint statistics file', 'DDAML (XML) file', 'HDF5 file', &
         'checkpoint file', 'labelled model file']
      name = trim(names(max(0, min(9, kind))))
   end function kind_name

   !> Does the file begin with the signature of HDF5?
   logical function is_hdf5(path)
      character(len=*), intent(in) :: path
      character(len=8) :: start
      integer :: unit, status
      is_hdf5 = .false.
      if (get_file_size(path) < 8) return
      open (newunit=unit, file=path, status='old', action='read', access='stream', form='unformatted', iostat=status)
      if (status /= 0) return
      read (unit, iostat=status) start
      if (status == 0) is_hdf5 = start == char(137)//'HDF'//char(13)//char(10)//char(26)//char(10)
      close (unit)
   end function is_hdf5

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

end module rockdda_io_recognise
