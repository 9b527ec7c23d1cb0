! SPDX-License-Identifier: MIT
!> rockdda info: contents of files.
module rockdda_app_command_info
   use rockdda_base_error, only : error_type, error_code
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_io_recognise, only : file_kind
   use rockdda_run_find_files, only : recognise_file
   use rockdda_run_input, only : model_input_type
   use rockdda_run_read_files, only : read_blocks, count_points
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_facts, only : facts_type
   use rockdda_app_file_facts, only : describe_file
   use rockdda_app_conversion, only : list_files
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : argument_type, print_line
   use rockdda_app_report, only : show_messages, begin_json, end_json, report_failure
   implicit none
   private
   public :: run_info

contains

   !> Run the command; returns the exit code.
   subroutine run_info(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      type(argument_type), allocatable :: files(:)
      type(facts_type), allocatable :: facts(:)
      type(json_type) :: json
      integer :: i, kind, points(2)
      logical :: ok, printed

      call list_files(line, files, messages, error)
      if (allocated(error)) then
         call report_failure(line, messages, error, exit_code)
         return
      end if
      allocate (facts(size(files)))
      call find_points(files, points)
      do i = 1, size(files)
         call recognise_file(files(i)%text, kind, messages, ok)
         facts(i)%title = files(i)%text
         if (ok) call describe_file(files(i)%text, kind, line%dialect, points, facts(i), messages)
      end do
      exit_code = merge(error_code%input, 0, messages%has_errors())
      call show_messages(messages, merge(severity%error, severity%warning, line%quiet))
      ok = .true.
      if (line%json) then
         call begin_json(json, line, trim(merge('error', 'done ', messages%has_errors())), exit_code)
         call json%open('[', 'files')
         do i = 1, size(facts)
            call facts(i)%to_json(json, '')
         end do
         call json%close(']')
         call end_json(json, messages, error, ok)
      else
         do i = 1, size(facts)
            if (facts(i)%n == 0) cycle
            call print_line(facts(i)%to_text(), printed)
            ok = ok .and. printed
         end do
      end if
      if (.not. ok) exit_code = error_code%output
   end subroutine run_info

   !> Find the numbers of fixed and loading points of the first model among the files, which the reader of an analysis
   !> file may need; -1 without a model.
   subroutine find_points(files, points)
      type(argument_type), intent(in) :: files(:)
      integer, intent(out) :: points(2)
      type(model_input_type) :: input
      type(diagnostics_type) :: reported_later
      type(error_type), allocatable :: error
      integer :: kinds(size(files)), i
      logical :: ok
      points = -1
      do i = 1, size(kinds)
         call recognise_file(files(i)%text, kinds(i), reported_later, ok)
      end do
      if (count(kinds == file_kind%analysis) == 0) return
      do i = 1, size(kinds)
         if (kinds(i) /= file_kind%geometry .and. kinds(i) /= file_kind%blocks) cycle
         input%model_file = files(i)%text
         input%model_kind = kinds(i)
         call read_blocks(input, reported_later, error)
         call count_points(input, points(1), points(2))
         return
      end do
   end subroutine find_points

end module rockdda_app_command_info
