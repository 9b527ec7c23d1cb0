! SPDX-License-Identifier: MIT
!> From the files of a command line to a model and the parameters of its run.
module rockdda_app_model_input
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type, resolve_parameters
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_io_analysis_file, only : read_analysis_source
   use rockdda_io_block_file, only : read_block_source
   use rockdda_io_geometry_file, only : read_geometry_source
   use rockdda_io_material_check, only : check_geometry_materials, check_block_materials
   use rockdda_io_model_folder, only : find_model_files
   use rockdda_io_namelist_file, only : read_options_source
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : recognise, file_kind, kind_name
   use rockdda_io_source, only : source_type, read_source
   use rockdda_linear_factory, only : default_solver
   use rockdda_app_arguments, only : command_line_type, apply_to_options
   implicit none
   private
   public :: model_input_type, find_files, read_model, read_blocks, count_points, recognise_file, stem_of

   type :: model_input_type
      ! which files
      character(len=:), allocatable :: model_file      !! geometry or blocks
      character(len=:), allocatable :: analysis_file   !! '' when there is none, and so below
      character(len=:), allocatable :: config_file
      integer :: model_kind = 0                        !! file_kind%geometry or file_kind%blocks
      ! what they say
      character(len=:), allocatable :: model_text, analysis_text, config_text
      type(geometry_input_type) :: geometry
      type(cut_report_type) :: cut
      type(block_system_type) :: blocks
      type(analysis_input_type) :: analysis
      type(run_options_type) :: options
      type(parameters_type) :: parameters
      logical :: has_blocks = .false.                  !! blocks are valid
   end type model_input_type

contains

   !> Find the files of a run: a folder, or a geometry or block file and an analysis file.
   subroutine find_files(line, input, messages, error)
      type(command_line_type), intent(in) :: line
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: kinds(2), i
      logical :: ok, all_ok
      input%config_file = line%config
      if (size(line%files) == 1) then
         if (get_path_kind(line%files(1)%text) == path_kind%directory) then
            call find_in_folder(line%files(1)%text, input, error)
            return
         end if
      end if
      if (size(line%files) /= 2) then
         call make_error(error, error_code%input, "'rockdda run' needs a geometry or block file and an analysis "// &
                         'file, or one folder with them; found '//to_string(size(line%files))// &
                         trim(merge(' file ', ' files', size(line%files) == 1))//", see 'rockdda run --help'")
         return
      end if
      all_ok = .true.
      do i = 1, 2
         call recognise_file(line%files(i)%text, kinds(i), messages, ok)
         all_ok = all_ok .and. ok
      end do
      if (.not. all_ok) return
      input%model_file = line%files(1)%text
      input%analysis_file = line%files(2)%text
      input%model_kind = kinds(1)
      if (is_model(kinds(2)) .and. kinds(1) == file_kind%analysis) then
         call wrong_kind(1, 'a geometry or block file; the two files are in the wrong order')
      else
         if (.not. is_model(kinds(1))) call wrong_kind(1, 'a geometry or block file')
         if (kinds(2) /= file_kind%analysis) call wrong_kind(2, 'an analysis file')
      end if

   contains

      !> A file that is not what its place asks for.
      subroutine wrong_kind(place, expected)
         integer, intent(in) :: place
         character(len=*), intent(in) :: expected
         type(origin_type) :: origin
         origin%file = line%files(place)%text
         if (kinds(place) == file_kind%ddaml) then
            call messages%add(severity%error, "this is a DDAML (XML) file; convert it first with 'rockdda-post "// &
                              "convert'", origin)
         else
            call messages%add(severity%error, &
                              'expected '//expected//', found '//with_article(kind_name(kinds(place))), &
                              origin)
         end if
      end subroutine wrong_kind

   end subroutine find_files

   !> The files of a folder; an options file of the command line wins over the folder's.
   subroutine find_in_folder(folder, input, error)
      character(len=*), intent(in) :: folder
      type(model_input_type), intent(inout) :: input
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: config
      call find_model_files(folder, input%model_file, input%analysis_file, config, error)
      if (allocated(error)) return
      if (allocated(config) .and. len(input%config_file) == 0) input%config_file = config
      call recognise(input%model_file, input%model_kind, error)
   end subroutine find_in_folder

   !> Read everything, cut if need be, and put the parameters of the run together. Every problem goes into
   !> `messages`; `error` is what cutting says about a geometry that it cannot cut.
   subroutine read_model(line, input, messages, error)
      type(command_line_type), intent(in) :: line
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: before
      call read_config(input, messages)
      call apply_to_options(line, input%options)
      call read_blocks(input, messages, error)
      before = messages%n_errors
      call read_analysis(line, input, messages)
      if (messages%n_errors > before) return
      if (input%model_kind == file_kind%geometry .and. allocated(input%geometry%line_joint)) then
         call check_geometry_materials(input%geometry, input%analysis, messages)
      else if (input%has_blocks) then
         call check_block_materials(input%blocks, input%analysis, input%model_file, messages)
      end if
      if (messages%has_errors() .or. .not. input%has_blocks) return
      call choose_solver(input%options, messages)
      call resolve_parameters(input%blocks, input%analysis, input%options, input%parameters, messages)
      if (len(input%parameters%title) == 0) input%parameters%title = stem_of(input%analysis_file)
   end subroutine read_model

   !> Read the options, if there is a file of them.
   subroutine read_config(input, messages)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      input%config_text = ''
      if (len(input%config_file) == 0) return
      call read_source(input%config_file, source, messages, ok)
      if (.not. ok) return
      input%config_text = source%text
      call read_options_source(source, input%options, messages)
   end subroutine read_config

   !> Read a block file, or read a geometry file and cut it.
   subroutine read_blocks(input, messages, error)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(source_type) :: source
      integer :: before
      logical :: ok
      input%has_blocks = .false.
      input%model_text = ''
      before = messages%n_errors
      call read_source(input%model_file, source, messages, ok)
      if (.not. ok) return
      input%model_text = source%text
      if (input%model_kind == file_kind%blocks) then
         call read_block_source(source, input%blocks, messages)
      else
         call read_geometry_source(source, input%geometry, messages)
         if (messages%n_errors > before) then
            ! what was read only in part cannot be checked further
            if (allocated(input%geometry%line_joint)) deallocate (input%geometry%line_joint)
            return
         end if
         call cut_blocks(input%geometry, input%blocks, input%cut, messages, error)
      end if
      input%has_blocks = messages%n_errors == before .and. .not. allocated(error)
   end subroutine read_blocks

   !> Read the analysis file; the number of points of the model decides between dialects when it is known.
   subroutine read_analysis(line, input, messages)
      type(command_line_type), intent(in) :: line
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      integer :: n_fixed, n_loading
      logical :: ok
      input%analysis_text = ''
      call read_source(input%analysis_file, source, messages, ok)
      if (.not. ok) return
      input%analysis_text = source%text
      call count_points(input, n_fixed, n_loading)
      call read_analysis_source(source, n_fixed, n_loading, line%dialect, input%analysis, messages)
   end subroutine read_analysis

   !> Fixed and loading points of the model; as far as a geometry with errors lets them be known, else -1.
   subroutine count_points(input, n_fixed, n_loading)
      type(model_input_type), intent(in) :: input
      integer, intent(out) :: n_fixed, n_loading
      n_fixed = -1
      n_loading = -1
      if (input%has_blocks) then
         n_fixed = input%blocks%fixed%n
         n_loading = input%blocks%loading%n
      else if (allocated(input%geometry%fixed_lines)) then
         ! fixed lines that are points stay as many when they are cut
         if (any(abs(input%geometry%fixed_lines(1:2, :) - input%geometry%fixed_lines(3:4, :)) > 0)) return
         n_fixed = size(input%geometry%fixed_lines, 2)
         n_loading = size(input%geometry%loading_points, 2)
      end if
   end subroutine count_points

   !> Without a choice of the user: the default of this build.
   subroutine choose_solver(options, messages)
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      if (allocated(options%method)) then
         if (len_trim(options%method) > 0) return
      end if
      options%method = default_solver()
      call messages%add(severity%note, 'solver chosen automatically: '//options%method)
   end subroutine choose_solver

   !> Kind of a file; a problem becomes a message and ok is false.
   subroutine recognise_file(path, kind, messages, ok)
      character(len=*), intent(in) :: path
      integer, intent(out) :: kind                 !! one of file_kind%...
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      type(error_type), allocatable :: error
      type(origin_type) :: origin
      integer :: first
      call recognise(path, kind, error)
      ok = .not. allocated(error)
      if (ok) return
      first = index(error%message, ': error: ')
      if (first > 0) then
         origin%file = error%message(1:first - 1)
         call messages%add(severity%error, error%message(first + 9:), origin)
      else
         call messages%add(severity%error, error%message)
      end if
   end subroutine recognise_file

   !> Can this kind of file be the model of a run?
   pure logical function is_model(kind)
      integer, intent(in) :: kind
      is_model = kind == file_kind%geometry .or. kind == file_kind%blocks
   end function is_model

   !> "an options file", "a block file"
   pure function with_article(noun) result(text)
      character(len=*), intent(in) :: noun
      character(len=:), allocatable :: text
      text = 'a '//noun
      if (scan(noun(1:1), 'aeiouH') > 0) text = 'an '//noun
   end function with_article

   !> File name without folders and without its last ending.
   pure function stem_of(path) result(stem)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: stem
      integer :: dot
      stem = path(index(path, '/', back=.true.) + 1:)
      dot = index(stem, '.', back=.true.)
      if (dot > 1) stem = stem(1:dot - 1)
   end function stem_of

end module rockdda_app_model_input
