! SPDX-License-Identifier: MIT
!> Read the files of a run, or texts in memory, into a model and the parameters of its run.
module rockdda_run_model_input
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type, unset_integer, unset_real, is_set, most_threads
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_joint_options, only : count_joint_materials
   use rockdda_model_resolve, only : resolve_parameters
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_io_analysis_file, only : read_analysis_source
   use rockdda_io_block_file, only : read_block_source
   use rockdda_io_geometry_file, only : read_geometry_source
   use rockdda_io_material_check, only : check_geometry_materials, check_block_materials
   use rockdda_io_model_folder, only : find_model_files
   use rockdda_io_namelist_file, only : read_options_source
   use rockdda_io_plausibility, only : check_plausibility
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : recognise, file_kind, kind_name, ddaml_advice
   use rockdda_io_source, only : source_type, read_source, new_source
   use rockdda_linear_factory, only : default_solver
   use rockdda_run_cells, only : check_regions, make_cells
   use rockdda_stepping_options_check, only : check_options
   implicit none
   private
   public :: model_input_type, run_request_type
   public :: find_files, read_model, read_blocks, count_points, recognise_file, stem_of

   !> Options of the command line or of the Python call; they override the options file.
   type :: run_request_type
      character(len=:), allocatable :: output        !! '' when not given, and so below
      character(len=:), allocatable :: config
      character(len=:), allocatable :: solver
      integer :: dialect = 0                         !! one of dialect%...
      integer :: threads = unset_integer
      integer :: steps = unset_integer
      integer :: save_every = unset_integer
      real(wp) :: t_end = unset_real
      real(wp) :: max_wall = unset_real
      real(wp) :: checkpoint_every = unset_real
      logical :: strict = .false.                    !! a false energy balance ends the run
      logical :: force = .false.                     !! overwrite an older result
   end type run_request_type

   type :: model_input_type
      ! which files
      character(len=:), allocatable :: model_file      !! geometry or blocks
      character(len=:), allocatable :: analysis_file   !! '' when there is none, and so below
      character(len=:), allocatable :: config_file
      integer :: model_kind = 0                        !! file_kind%geometry or file_kind%blocks
      logical :: in_memory = .false.                   !! the texts are given; file names are for messages only
      ! their content
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

   !> Find the files of a run: a folder (then without an analysis file), or a geometry or block file and an analysis
   !> file.
   subroutine find_files(model, analysis, config, input, messages, error)
      character(len=*), intent(in) :: model     !! a file or a folder
      character(len=*), intent(in) :: analysis  !! '' for a folder
      character(len=*), intent(in) :: config    !! options file, '' for none or that of the folder
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: kinds(2)
      logical :: ok(2)
      input%config_file = config
      if (len(analysis) == 0) then
         call find_in_folder(model, input, error)
         return
      end if
      call recognise_file(model, kinds(1), messages, ok(1))
      call recognise_file(analysis, kinds(2), messages, ok(2))
      if (.not. all(ok)) return
      input%model_file = model
      input%analysis_file = analysis
      input%model_kind = kinds(1)
      if (is_model(kinds(2)) .and. kinds(1) == file_kind%analysis) then
         call wrong_kind(model, kinds(1), 'a geometry or block file; the two files are in the wrong order')
      else
         if (.not. is_model(kinds(1))) call wrong_kind(model, kinds(1), 'a geometry or block file')
         if (kinds(2) /= file_kind%analysis) call wrong_kind(analysis, kinds(2), 'an analysis file')
      end if

   contains

      !> Report a file of the wrong kind.
      subroutine wrong_kind(path, kind, expected)
         character(len=*), intent(in) :: path, expected
         integer, intent(in) :: kind               !! found
         type(origin_type) :: origin
         origin%file = path
         if (kind == file_kind%ddaml) then
            call messages%add(severity%error, ddaml_advice, origin)
         else
            call messages%add(severity%error, &
                              'expected '//expected//', found '//with_article(kind_name(kind)), origin)
         end if
      end subroutine wrong_kind

   end subroutine find_files

   !> Find the files of a folder; an options file of the command line overrides that of the folder.
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

   !> Read all files, cut a geometry into blocks and blocks into cells, and resolve the parameters of the run.
   !> Every problem is added to `messages`; `error` is a failure of the cutting.
   subroutine read_model(request, input, messages, error)
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: before, n_joint
      call read_config(input, messages)
      call apply_to_options(request, input%options)
      if (request%threads > most_threads) call messages%add(severity%error, 'threads: must be '// &
         to_string(most_threads)//' or less, found '//to_string(request%threads))
      call read_blocks(input, messages, error)
      before = messages%n_errors
      call read_analysis(request%dialect, input, messages)
      if (messages%n_errors > before) return
      n_joint = count_joint_materials(size(input%analysis%joint_materials), input%options%joint_materials)
      if (input%model_kind == file_kind%geometry .and. allocated(input%geometry%line_joint)) then
         call check_geometry_materials(input%geometry, input%analysis, n_joint, messages)
      else if (input%has_blocks) then
         call check_block_materials(input%blocks, input%analysis, n_joint, input%model_file, messages)
      end if
      if (messages%has_errors() .or. .not. input%has_blocks) return
      if (.not. allocated(input%options%joint_materials)) allocate (input%options%joint_materials(0))
      if (.not. allocated(input%options%joint_laws)) allocate (input%options%joint_laws(0))
      if (.not. allocated(input%options%regions)) allocate (input%options%regions(0))
      if (.not. allocated(input%options%subdivisions)) allocate (input%options%subdivisions(0))
      call check_regions(input%blocks, input%options%regions, size(input%analysis%block_materials), messages)
      if (messages%has_errors()) return
      call make_cells(input%options%regions, input%options%subdivisions, n_joint, &
                      [input%options%joint_materials, input%options%joint_laws], input%blocks, messages)
      if (messages%has_errors()) return
      call choose_solver(input%options, messages)
      call resolve_parameters(input%blocks, input%analysis, input%options, input%parameters, messages)
      call check_options(input%blocks, input%parameters, messages)
      if (.not. messages%has_errors()) call check_plausibility(input%blocks, input%parameters, input%options, &
         input%analysis_file, input%config_file, messages)
      if (len(input%parameters%title) == 0) input%parameters%title = stem_of(input%analysis_file)
   end subroutine read_model

   !> Read the options, if there is a file of them.
   subroutine read_config(input, messages)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      if (.not. allocated(input%config_text)) input%config_text = ''
      if (len(input%config_file) == 0) return
      call get_source(input%in_memory, input%config_file, input%config_text, source, messages, ok)
      if (.not. ok) return
      call read_options_source(source, input%options, messages)
   end subroutine read_config

   !> Get the text of a file; `text` is given when it is in memory, and set otherwise.
   subroutine get_source(in_memory, file, text, source, messages, ok)
      logical, intent(in) :: in_memory
      character(len=*), intent(in) :: file
      character(len=:), allocatable, intent(inout) :: text
      type(source_type), intent(out) :: source
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      if (in_memory) then
         call new_source(file, text, source)
         ok = .true.
         return
      end if
      text = ''
      call read_source(file, source, messages, ok)
      if (ok) text = source%text
   end subroutine get_source

   !> Override options of the file by those of the request.
   pure subroutine apply_to_options(request, options)
      class(run_request_type), intent(in) :: request
      type(run_options_type), intent(inout) :: options
      if (is_set(request%threads)) options%threads = request%threads
      if (is_set(request%steps)) options%steps = request%steps
      if (is_set(request%t_end)) options%t_end = request%t_end
      if (is_set(request%max_wall)) options%max_wall = request%max_wall
      if (is_set(request%checkpoint_every)) options%checkpoint_every = request%checkpoint_every
      if (is_set(request%save_every)) then
         options%save_every = request%save_every
         options%save_dt = unset_real
      end if
      options%strict = options%strict .or. request%strict
      if (len(request%solver) > 0) options%method = request%solver
      if (len(request%output) > 0) options%output_file = request%output
   end subroutine apply_to_options

   !> Read a block file, or read a geometry file and cut it.
   subroutine read_blocks(input, messages, error)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(source_type) :: source
      integer :: before
      logical :: ok
      input%has_blocks = .false.
      before = messages%n_errors
      call get_source(input%in_memory, input%model_file, input%model_text, source, messages, ok)
      if (.not. ok) return
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

   !> Read the analysis file; the number of points of the model, when available, decides between dialects.
   subroutine read_analysis(way, input, messages)
      integer, intent(in) :: way                   !! one of dialect%...
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      integer :: n_fixed, n_loading
      logical :: ok
      call get_source(input%in_memory, input%analysis_file, input%analysis_text, source, messages, ok)
      if (.not. ok) return
      call count_points(input, n_fixed, n_loading)
      call read_analysis_source(source, n_fixed, n_loading, way, input%analysis, messages)
   end subroutine read_analysis

   !> Count the fixed and loading points of the model; -1 when a geometry with errors does not determine them.
   subroutine count_points(input, n_fixed, n_loading)
      type(model_input_type), intent(in) :: input
      integer, intent(out) :: n_fixed, n_loading
      n_fixed = -1
      n_loading = -1
      if (input%has_blocks) then
         n_fixed = input%blocks%fixed%n
         n_loading = input%blocks%loading%n
      else if (allocated(input%geometry%fixed_lines)) then
         ! cutting does not change the number of fixed lines that are points
         if (any(abs(input%geometry%fixed_lines(1:2, :) - input%geometry%fixed_lines(3:4, :)) > 0)) return
         n_fixed = size(input%geometry%fixed_lines, 2)
         n_loading = size(input%geometry%loading_points, 2)
      end if
   end subroutine count_points

   !> Set the default solver of this build, unless the user chose one.
   subroutine choose_solver(options, messages)
      type(run_options_type), intent(inout) :: options
      type(diagnostics_type), intent(inout) :: messages
      if (allocated(options%method)) then
         if (len_trim(options%method) > 0) return
      end if
      options%method = default_solver()
      call messages%add(severity%note, 'solver: '//options%method//' (the default)')
   end subroutine choose_solver

   !> Find the kind of a file; a problem becomes a message and ok is false.
   subroutine recognise_file(path, kind, messages, ok)
      character(len=*), intent(in) :: path
      integer, intent(out) :: kind                 !! one of file_kind%...
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      type(error_type), allocatable :: error
      call recognise(path, kind, error)
      ok = .not. allocated(error)
      if (.not. ok) call messages%add_error(error)
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

end module rockdda_run_model_input
