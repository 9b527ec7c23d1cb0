! SPDX-License-Identifier: MIT
!> rockdda check: every problem of every file, computes nothing.
module rockdda_app_command_check
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : counted
   use rockdda_model_analysis_input, only : analysis_input_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_report, only : lines_report_type
   use rockdda_lines_statistics, only : statistics_type
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_analysis_file, only : read_analysis_file
   use rockdda_io_block_file, only : read_block_file
   use rockdda_io_checkpoint, only : checkpoint_facts_type, results_path
   use rockdda_io_digest, only : digest_length
   use rockdda_io_geometry_file, only : read_geometry_file
   use rockdda_io_option_documents, only : options_markdown, options_schema
   use rockdda_io_namelist_file, only : read_options_file
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : file_kind, kind_name, ddaml_advice
   use rockdda_io_results_info, only : results_info_type, read_results_info
   use rockdda_run_checkpointing, only : load_checkpoint
   use rockdda_run_model_input, only : model_input_type, read_model, recognise_file
   use rockdda_io_statistics_file, only : read_statistics_file
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_file_list, only : list_files
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : argument_type, print_line
   use rockdda_app_report, only : show_messages, show_error, begin_json, end_json
   implicit none
   private
   public :: run_check

contains

   !> Run the command; returns the exit code.
   subroutine run_check(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(argument_type), allocatable :: files(:)
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      integer, allocatable :: kinds(:)
      integer :: i
      logical :: ok
      logical, allocatable :: readable(:)

      if (line%options_table) then
         call print_options(line%json, ok)
         exit_code = merge(0, error_code%output, ok)
         return
      end if
      call list_files(line, files, messages, error)
      allocate (kinds(size(files)), readable(size(files)))
      do i = 1, size(files)
         call recognise_file(files(i)%text, kinds(i), messages, readable(i))
      end do
      if (is_model_run(kinds)) then
         call check_together(line, files, kinds, messages, error)
         readable = readable .and. .not. is_input(kinds)
      end if
      do i = 1, size(files)
         if (readable(i)) call check_alone(line, files(i)%text, kinds(i), messages)
      end do
      exit_code = 0
      if (messages%has_errors() .or. allocated(error)) exit_code = error_code%input
      if (.not. line%json) call show_messages(messages, merge(severity%error, severity%note, line%quiet))
      if (line%json) call show_messages(messages, severity%error)
      if (allocated(error)) call show_error(error)
      call summarise(line, files, kinds, messages, error, exit_code, ok)
      if (.not. ok) exit_code = error_code%output
   end subroutine run_check

   !> Print the table of options of a run: Markdown, or with --json a JSON Schema.
   subroutine print_options(json, ok)
      logical, intent(in) :: json
      logical, intent(out) :: ok
      character(len=:), allocatable :: text
      if (json) then
         text = options_schema()
      else
         text = options_markdown()
      end if
      call print_line(text(:len(text) - 1), ok)
   end subroutine print_options

   !> Are among these the files of one run: a geometry or block file, an analysis file, at most one options file?
   pure logical function is_model_run(kinds)
      integer, intent(in) :: kinds(:)
      is_model_run = count(kinds == file_kind%geometry .or. kinds == file_kind%blocks) == 1 .and. &
                     count(kinds == file_kind%analysis) == 1 .and. count(kinds == file_kind%options) <= 1
   end function is_model_run

   !> Is this kind of file input of a run?
   elemental logical function is_input(kind)
      integer, intent(in) :: kind
      is_input = kind == file_kind%geometry .or. kind == file_kind%blocks .or. kind == file_kind%analysis .or. &
                 kind == file_kind%options
   end function is_input

   !> Check the files of one run, also for consistency.
   subroutine check_together(line, files, kinds, messages, error)
      type(command_line_type), intent(in) :: line
      type(argument_type), intent(in) :: files(:)
      integer, intent(in) :: kinds(:)
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(model_input_type) :: input
      type(simulation_type) :: sim
      integer :: i
      input%config_file = ''
      do i = 1, size(files)
         if (kinds(i) == file_kind%analysis) then
            input%analysis_file = files(i)%text
         else if (kinds(i) == file_kind%options) then
            input%config_file = files(i)%text
         else if (is_input(kinds(i))) then
            input%model_file = files(i)%text
            input%model_kind = kinds(i)
         end if
      end do
      call read_model(line, input, messages, error)
      ! errors that a run would report before its first step
      if (.not. allocated(error) .and. .not. messages%has_errors()) call sim%init(input%blocks, input%parameters, error)
   end subroutine check_together

   !> Check one file by itself.
   subroutine check_alone(line, path, kind, messages)
      type(command_line_type), intent(in) :: line
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind                  !! one of file_kind%...
      type(diagnostics_type), intent(inout) :: messages
      type(geometry_input_type) :: geometry
      type(block_system_type) :: blocks
      type(analysis_input_type) :: analysis
      type(run_options_type) :: options
      type(cut_report_type) :: report
      type(statistics_type) :: statistics
      type(lines_report_type) :: lines
      type(results_info_type) :: results
      type(error_type), allocatable :: error
      type(origin_type) :: origin
      integer :: before
      before = messages%n_errors
      select case (kind)
      case (1)
         call read_geometry_file(path, geometry, messages)
         if (messages%n_errors == before) call cut_blocks(geometry, blocks, report, messages, error)
      case (2)
         call read_analysis_file(path, -1, -1, line%dialect, analysis, messages)
      case (3)
         call read_block_file(path, blocks, messages)
      case (4)
         call read_options_file(path, options, messages)
      case (5)
         call read_statistics_file(path, statistics, messages)
         if (messages%n_errors == before) call generate_lines(statistics, geometry, lines, messages)
      case (7)
         call read_results_info(path, results, error)
      case (8)
         call check_checkpoint(path, messages, error)
      case (6)
         origin%file = path
         call messages%add(severity%error, ddaml_advice, origin)
      case default
         origin%file = path
         call messages%add(severity%error, 'this version cannot check this file, it is of the kind: '// &
                           kind_name(kind), origin)
      end select
      if (allocated(error)) call messages%add_error(error)
   end subroutine check_alone

   !> Check a checkpoint completely, and that its results are in the same folder.
   subroutine check_checkpoint(path, messages, error)
      character(len=*), intent(in) :: path
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(simulation_type) :: sim
      type(checkpoint_facts_type) :: facts
      type(origin_type) :: origin
      character(len=digest_length) :: digest
      call load_checkpoint(path, sim, facts, digest, error)
      origin%file = path
      if (allocated(error)) then
         call messages%add(severity%error, error%message(len(path) + 3:), origin)
         deallocate (error)
      else if (get_path_kind(results_path(path, facts%results_ending)) /= path_kind%file) then
         call messages%add(severity%warning, 'its results '//results_path(path, facts%results_ending)// &
                           ' are not beside it', origin)
      end if
   end subroutine check_checkpoint

   !> Print the messages.
   subroutine summarise(line, files, kinds, messages, error, exit_code, ok)
      type(command_line_type), intent(in) :: line
      type(argument_type), intent(in) :: files(:)
      integer, intent(in) :: kinds(:)
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(in) :: error
      integer, intent(in) :: exit_code
      logical, intent(out) :: ok
      type(json_type) :: json
      integer :: i, n_errors
      if (line%json) then
         call begin_json(json, line, trim(merge('done ', 'error', exit_code == 0)), exit_code)
         call json%open('[', 'files')
         do i = 1, size(files)
            call json%open('{', '')
            call json%put('file', files(i)%text)
            call json%put('kind', kind_name(kinds(i)))
            call json%close('}')
         end do
         call json%close(']')
         call end_json(json, messages, error, ok)
         return
      end if
      n_errors = messages%n_errors + merge(1, 0, allocated(error))
      ok = .true.
      if (size(files) == 0 .and. allocated(error)) return
      call print_line(counted(size(files), 'file')//' checked: '//counted(n_errors, 'error')//', '// &
               counted(messages%n_warnings, 'warning'), ok)
   end subroutine summarise

end module rockdda_app_command_check
