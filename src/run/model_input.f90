! SPDX-License-Identifier: MIT
!> Read the files of a run, or texts in memory, into a model and the parameters of its run.
module rockdda_run_model_input
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_boundary_check, only : check_boundaries
   use rockdda_model_in_situ, only : check_in_situ
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type, unset_integer, unset_real, is_set, most_threads
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_joint_options, only : described_joints
   use rockdda_model_material_options, only : described_blocks
   use rockdda_model_resolve, only : resolve_parameters, put_materials_together
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_io_analysis_file, only : read_analysis_source
   use rockdda_io_block_file, only : read_block_source
   use rockdda_io_geometry_file, only : read_geometry_source
   use rockdda_io_material_check, only : check_geometry_materials, check_block_materials
   use rockdda_io_material_use, only : check_lines_described, check_blocks_described
   use rockdda_io_model_folder, only : find_model_files
   use rockdda_io_namelist_file, only : read_options_source
   use rockdda_io_namelist_parser, only : beside
   use rockdda_io_plausibility, only : check_plausibility
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : recognise, file_kind, kind_name, ddaml_advice
   use rockdda_io_source, only : source_type, read_source, new_source
   use rockdda_linear_factory, only : default_solver
   use rockdda_run_cells, only : number_regions, check_regions, count_regions, check_names, check_cells, make_cells
   use rockdda_run_stage_regions, only : number_changes, check_stage_regions
   use rockdda_run_water_names, only : check_water_names, check_stage_water
   use rockdda_stepping_options_check, only : check_options, check_joints
   implicit none
   private
   public :: model_input_type, run_request_type
   public :: find_files, read_model, read_blocks, count_points, recognise_file, stem_of, run_name

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
      logical :: labelled = .false.                    !! the options file is a labelled file, which names the others
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

   !> Find the files of a run: a folder or a labelled file (then without an analysis file), or a geometry or block file
   !> and an analysis file. The files that a labelled file names are found when it is read.
   subroutine find_files(model, analysis, config, input, messages, error)
      character(len=*), intent(in) :: model     !! a file or a folder
      character(len=*), intent(in) :: analysis  !! '' for a folder or a labelled file
      character(len=*), intent(in) :: config    !! options file, '' for none or that of the folder
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: kinds(2)
      logical :: ok(2)
      input%config_file = config
      if (len(analysis) == 0) then
         if (get_path_kind(model) == path_kind%directory) then
            call find_in_folder(model, input, error)
            return
         end if
      end if
      call recognise_file(model, kinds(1), messages, ok(1))
      if (len(analysis) == 0) then
         if (ok(1) .and. kinds(1) == file_kind%labelled) then
            call take_labelled(model, input, error)
         else if (ok(1)) then
            call wrong_kind(model, kinds(1), 'a labelled file (.nml with &model), or a folder, or a geometry or '// &
                            'block file and an analysis file')
         end if
         return
      end if
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
      if (len(input%model_file) == 0) then
         call take_labelled(config, input, error)
         return
      end if
      if (allocated(config) .and. len(input%config_file) == 0) input%config_file = config
      call recognise(input%model_file, input%model_kind, error)
   end subroutine find_in_folder

   !> Take a labelled file, which takes no options file beside it.
   subroutine take_labelled(path, input, error)
      character(len=*), intent(in) :: path
      type(model_input_type), intent(inout) :: input
      type(error_type), allocatable, intent(out) :: error
      if (len(input%config_file) > 0) then
         call make_error(error, error_code%input, path//': error: a labelled file holds all options; leave out '// &
                         '--config '//input%config_file)
         return
      end if
      input%labelled = .true.
      input%config_file = path
      input%model_file = ''
      input%analysis_file = ''
   end subroutine take_labelled

   !> Find the files that a labelled file names, beside it.
   subroutine find_named_files(input, messages, ok)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok                 !! there is a model to be read
      integer :: kind
      logical :: found
      ok = .false.
      if (.not. input%options%labelled) then
         call messages%add(severity%error, 'there is no group &model, which names the geometry', whole_file())
         return
      else if (.not. input%labelled) then
         call messages%add(severity%error, 'a file with &model is a whole model: run it by itself', &
                           input%options%model_origin)
         return
      end if
      if (input%in_memory) then
         ok = .true.
         return
      end if
      if (allocated(input%options%analysis)) then
         if (len_trim(input%options%analysis) > 0) then
            input%analysis_file = beside(input%config_file, trim(adjustl(input%options%analysis)))
            call recognise_file(input%analysis_file, kind, messages, found)
            if (found .and. kind /= file_kind%analysis) call messages%add(severity%error, input%analysis_file// &
               ': expected an analysis file, found '//with_article(kind_name(kind)), input%options%model_origin)
            if (kind /= file_kind%analysis) input%analysis_file = ''
         end if
      end if
      if (.not. allocated(input%options%geometry)) return   ! reported by the reader
      if (len_trim(input%options%geometry) == 0) return
      input%model_file = beside(input%config_file, trim(adjustl(input%options%geometry)))
      call recognise_file(input%model_file, input%model_kind, messages, found)
      if (found .and. .not. is_model(input%model_kind)) call messages%add(severity%error, input%model_file// &
         ': expected a geometry or block file, found '//with_article(kind_name(input%model_kind)), &
         input%options%model_origin)
      ok = found .and. is_model(input%model_kind)

   contains

      !> The options file as a whole.
      function whole_file() result(origin)
         type(origin_type) :: origin
         origin%file = input%config_file
      end function whole_file

   end subroutine find_named_files

   !> Read all files, cut a geometry into blocks and blocks into cells, and resolve the parameters of the run.
   !> Every problem is added to `messages`; `error` is a failure of the cutting.
   subroutine read_model(request, input, messages, error)
      class(run_request_type), intent(in) :: request
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: before
      logical :: ok
      call read_config(input, messages)
      call check_ground_options(input%options, messages)
      call check_stage_water(input%options, messages)
      if (input%labelled .or. input%options%labelled) then
         call find_named_files(input, messages, ok)
         if (.not. ok) return
      end if
      call apply_to_options(request, input%options)
      if (request%threads > most_threads) call messages%add(severity%error, 'threads: must be '// &
         to_string(most_threads)//' or less, found '//to_string(request%threads))
      call read_blocks(input, messages, error)
      before = messages%n_errors
      if (len(input%analysis_file) > 0) call read_analysis(request%dialect, input, messages)
      if (.not. allocated(input%analysis_text)) input%analysis_text = ''
      if (messages%n_errors > before) return
      if (.not. allocated(input%options%block_materials)) allocate (input%options%block_materials(0))
      if (.not. allocated(input%options%joint_materials)) allocate (input%options%joint_materials(0))
      if (.not. allocated(input%options%joint_laws)) allocate (input%options%joint_laws(0))
      if (.not. allocated(input%options%regions)) allocate (input%options%regions(0))
      if (.not. allocated(input%options%subdivisions)) allocate (input%options%subdivisions(0))
      if (.not. allocated(input%options%stages)) allocate (input%options%stages(0))
      if (.not. allocated(input%options%changes)) allocate (input%options%changes(0))
      call check_materials(input, messages)
      if (.not. input%has_blocks) return
      if (messages%has_errors() .and. .not. input%labelled) return
      call make_parts(input, messages)
      if (messages%has_errors() .and. input%labelled) call find_further_errors(input, messages)
      if (messages%has_errors()) return
      call choose_solver(input%options, messages)
      call resolve_parameters(input%blocks, input%analysis, input%options, input%parameters, messages)
      call check_options(input%blocks, input%parameters, messages)
      if (.not. messages%has_errors()) call check_plausibility(input%blocks, input%parameters, input%options, &
         input%analysis_file, input%config_file, messages)
      if (len(input%parameters%title) == 0) input%parameters%title = run_name(input)
   end subroutine read_model

   !> Check that the materials of the model are described.
   subroutine check_materials(input, messages)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: blocks(:), joints(:)      !! described, by number
      integer :: n(2)
      n = 0
      if (allocated(input%analysis%block_materials)) n = [size(input%analysis%block_materials), &
                                                          size(input%analysis%joint_materials)]
      allocate (blocks, source=described_blocks(n(1), input%options%block_materials, input%labelled))
      allocate (joints, source=described_joints(n(2), input%options%joint_materials, input%labelled))
      if (input%labelled .and. n(1) == 0) then
         if (input%model_kind == file_kind%geometry .and. allocated(input%geometry%line_joint)) then
            call check_lines_described(input%geometry, input%blocks, blocks, joints, input%model_file, messages)
         else if (input%has_blocks) then
            call check_blocks_described(input%blocks, blocks, joints, input%model_file, messages)
         end if
      else if (input%model_kind == file_kind%geometry .and. allocated(input%geometry%line_joint)) then
         call check_geometry_materials(input%geometry, size(blocks), size(joints), messages)
      else if (input%has_blocks) then
         call check_block_materials(input%blocks, size(blocks), size(joints), input%model_file, messages)
      end if
   end subroutine check_materials

   !> What the next attempt would report of a labelled file with errors: materials, laws of joints, end of the run.
   subroutine find_further_errors(input, messages)
      type(model_input_type), intent(in) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(parameters_type) :: parameters
      call put_materials_together(input%analysis, input%options, parameters, messages)
      call check_joints(parameters%joint_materials, messages)
   end subroutine find_further_errors

   !> Regions, and the cells of blocks, by the names of their materials.
   subroutine make_parts(input, messages)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(diagnostics_type) :: counts, found
      integer :: n(2)
      n = 0
      if (allocated(input%analysis%block_materials)) n = [size(input%analysis%block_materials), &
                                                          size(input%analysis%joint_materials)]
      n = [size(described_blocks(n(1), input%options%block_materials, input%labelled)), &
           size(described_joints(n(2), input%options%joint_materials, input%labelled))]
      call number_regions(input%options%block_materials, input%options%regions, messages)
      call check_regions(input%blocks, input%options%regions, n(1), messages)
      call check_water_names(input%options, n(2), messages)
      if (messages%has_errors()) then
         call check_cells(input%options%regions, input%options%subdivisions, n(2), &
                          [input%options%joint_materials, input%options%joint_laws], messages)
         return
      end if
      ! how many blocks a region has before they are cut, noted when no error of the cutting is in the way
      call count_regions(input%blocks, input%options%regions, counts)
      call make_cells(input%options%regions, input%options%subdivisions, n(2), &
                      [input%options%joint_materials, input%options%joint_laws], input%blocks, found)
      if (.not. found%has_errors()) call messages%append(counts)
      call messages%append(found)
      call number_changes(input%options%block_materials, input%options%changes, messages)
      call check_stage_regions(input%blocks, input%options%stages, input%options%changes, input%options%regions, n(1), &
                               n(2), [input%options%joint_materials, input%options%joint_laws], messages)
   end subroutine make_parts

   !> Name of a run, from which those of its files are made: the stem of its labelled or analysis file.
   pure function run_name(input) result(name)
      type(model_input_type), intent(in) :: input
      character(len=:), allocatable :: name
      if (input%labelled) then
         name = stem_of(input%config_file)
      else
         name = stem_of(input%analysis_file)
      end if
   end function run_name

   !> Groups of &boundary and &in_situ, as far as they can be judged without a model.
   subroutine check_ground_options(options, messages)
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      if (allocated(options%boundaries)) call check_boundaries(options%boundaries, messages)
      if (.not. allocated(options%in_situ)) return
      call check_in_situ(options%in_situ, messages)
      do i = 1, size(options%in_situ)
         if (allocated(options%in_situ(i)%region)) call check_names('&in_situ', options%regions, &
            options%in_situ(i)%region, options%in_situ(i)%origin, messages)
      end do
   end subroutine check_ground_options

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
