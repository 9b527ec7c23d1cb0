! SPDX-License-Identifier: MIT
!> Checks of `rockdda check`: files of one run together, and one file by itself.
module rockdda_app_file_check
   use rockdda_base_error, only : error_type
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_lines_generate, only : generate_lines
   use rockdda_lines_report, only : lines_report_type
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_file_content, only : file_content_type
   use rockdda_io_recognise, only : file_kind, kind_name, ddaml_advice
   use rockdda_run_checkpointing, only : check_checkpoint
   use rockdda_run_model_input, only : model_input_type, read_model
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_process, only : argument_type
   implicit none
   private
   public :: check_together, check_alone, is_input, is_model_run

contains

   !> Are among these the files of one run: a geometry or block file, an analysis file, at most one options file; or one
   !> labelled file alone?
   pure logical function is_model_run(kinds)
      integer, intent(in) :: kinds(:)
      is_model_run = count(kinds == file_kind%geometry .or. kinds == file_kind%blocks) == 1 .and. &
                     count(kinds == file_kind%analysis) == 1 .and. count(kinds == file_kind%options) <= 1 .and. &
                     count(kinds == file_kind%labelled) == 0
      is_model_run = is_model_run .or. (count(kinds == file_kind%labelled) == 1 .and. .not. any(is_input(kinds)))
   end function is_model_run

   !> Is this kind of file input of a run?
   elemental logical function is_input(kind)
      integer, intent(in) :: kind
      is_input = kind == file_kind%geometry .or. kind == file_kind%blocks .or. kind == file_kind%analysis .or. &
                 kind == file_kind%options
   end function is_input

   !> Check the files of one run, also for consistency.
   subroutine check_together(line, files, kinds, input, messages, error)
      type(command_line_type), intent(in) :: line
      type(argument_type), intent(in) :: files(:)
      integer, intent(in) :: kinds(:)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      type(simulation_type) :: sim
      integer :: i
      input%config_file = ''
      input%model_file = ''
      input%analysis_file = ''
      do i = 1, size(files)
         if (kinds(i) == file_kind%analysis) then
            input%analysis_file = files(i)%text
         else if (kinds(i) == file_kind%options) then
            input%config_file = files(i)%text
         else if (kinds(i) == file_kind%labelled) then
            input%labelled = .true.
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

   !> Check one of several labelled files.
   subroutine check_labelled(line, path, messages)
      type(command_line_type), intent(in) :: line
      character(len=*), intent(in) :: path
      type(diagnostics_type), intent(inout) :: messages
      type(argument_type) :: file(1)
      type(model_input_type) :: input
      type(error_type), allocatable :: error
      file(1)%text = path
      call check_together(line, file, [file_kind%labelled], input, messages, error)
      if (allocated(error)) call messages%add_error(error)
   end subroutine check_labelled

   !> Check one file by itself.
   subroutine check_alone(line, path, kind, messages)
      type(command_line_type), intent(in) :: line
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind                  !! one of file_kind%...
      type(diagnostics_type), intent(inout) :: messages
      type(file_content_type) :: content
      type(cut_report_type) :: report
      type(lines_report_type) :: lines
      type(error_type), allocatable :: error
      type(origin_type) :: origin
      if (kind == file_kind%labelled) then
         call check_labelled(line, path, messages)
         return
      end if
      call content%read(path, kind, line%dialect, [-1, -1], messages)
      if (.not. content%valid) return
      origin%file = path
      select case (kind)
      case (file_kind%geometry)
         content%geometry%allow_open = line%allow_open
         call cut_blocks(content%geometry, content%blocks, report, messages, error)
         if (allocated(error)) call messages%add_error(error)
      case (file_kind%statistics)
         call generate_lines(content%statistics, content%geometry, lines, messages)
      case (file_kind%checkpoint)
         call check_checkpoint(path, messages)
      case (file_kind%ddaml)
         call messages%add(severity%error, ddaml_advice, origin)
      case (file_kind%unknown)
         call messages%add(severity%error, 'this version cannot check this file, it is of the kind: '// &
                           kind_name(kind), origin)
      end select
   end subroutine check_alone

end module rockdda_app_file_check
