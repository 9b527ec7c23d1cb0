! SPDX-License-Identifier: MIT
!> The text log of a run: what was read, the numbers it runs with, and one line per reported step.
!>
!> It is written beside the results: OUT.log for OUT.h5.
module rockdda_io_log
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : printable, to_string
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : step_record_type, n_energies, energy_names
   use rockdda_io_file_sink, only : file_sink_type
   use rockdda_io_parameter_text, only : parameters_text
   implicit none
   private
   public :: log_type, log_path

   type :: log_type
      type(file_sink_type), private :: sink
   contains
      procedure :: open => open_log
      procedure :: put
      procedure :: put_messages
      procedure :: put_model
      procedure :: put_parameters
      procedure :: put_columns
      procedure :: put_step
      procedure :: flush => flush_log
      procedure :: close => close_log
   end type log_type

contains

   !> Path of the log beside a results file: its ending .h5, .hdf5 or .hdf replaced by .log, else .log added.
   pure function log_path(results_path) result(path)
      character(len=*), intent(in) :: results_path
      character(len=:), allocatable :: path
      character(len=*), parameter :: endings(3) = [character(len=5) :: '.h5', '.hdf5', '.hdf']
      integer :: i, n
      do i = 1, size(endings)
         n = len(results_path) - len_trim(endings(i))
         if (n < 1) cycle
         if (results_path(n + 1:) /= trim(endings(i))) cycle
         path = results_path(1:n)//'.log'
         return
      end do
      path = results_path//'.log'
   end function log_path

   !> Start a log, replacing an older one unless it is to be continued.
   subroutine open_log(self, path, error, append)
      class(log_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      logical, intent(in), optional :: append       !! true: continue at the end
      call self%sink%open(path, error, append=append)
   end subroutine open_log

   !> Write one line (or several, separated by line ends).
   subroutine put(self, text, error)
      class(log_type), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_type), allocatable, intent(out) :: error
      call self%sink%put(printable(text, achar(9)//new_line('a'))//new_line('a'), error)
   end subroutine put

   !> Write the notes and warnings of reading and cutting.
   subroutine put_messages(self, messages, error)
      class(log_type), intent(inout) :: self
      type(diagnostics_type), intent(in) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      do i = 1, messages%n
         call self%put(messages%items(i)%format(), error)
         if (allocated(error)) return
      end do
   end subroutine put_messages

   !> Write the size of the model.
   subroutine put_model(self, blocks, error)
      class(log_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(error_type), allocatable, intent(out) :: error
      call self%put('model: '//to_string(blocks%n_blocks)//' blocks, '//to_string(blocks%n_vertices())// &
                    ' vertices, '//to_string(blocks%fixed%n)//' fixed points, '//to_string(blocks%loading%n)// &
                    ' loading points, '//to_string(blocks%measured%n)//' measured points, '// &
                    to_string(blocks%bolts%n)//' bolts', error)
   end subroutine put_model

   !> Write every number that the run uses.
   subroutine put_parameters(self, parameters, error, options)
      class(log_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      type(error_type), allocatable, intent(out) :: error
      type(run_options_type), intent(in), optional :: options   !! for those that are no number of the computation
      call self%put('parameters:'//parameters_text(parameters, options), error)
   end subroutine put_parameters

   !> Write the head of the table of steps.
   subroutine put_columns(self, error)
      class(log_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: head
      integer :: i
      head = '#     step          time            dt  tries rounds   solver     open  sliding   locked'// &
             '      disp/w0       penalty   unbalanced stage'
      do i = 1, n_energies
         head = head//' '//right(trim(energy_names(i)), 21)
      end do
      call self%put(head, error)
   end subroutine put_columns

   !> Write the line of an accepted step.
   subroutine put_step(self, record, parameters, error)
      class(log_type), intent(inout) :: self
      type(step_record_type), intent(in) :: record
      type(parameters_type), intent(in) :: parameters
      type(error_type), allocatable, intent(out) :: error
      character(len=400) :: text
      real(wp) :: ratio
      ratio = 0
      if (parameters%w0 > 0) ratio = record%max_displacement/parameters%w0
      write (text, '(i10, 2es14.6, i7, i7, i9, 3i9, es13.4, es14.6, es13.4, i6, *(es22.13))') record%step, &
         record%time, record%dt, record%attempts, record%open_close_iterations, record%solver_iterations, &
         record%contacts, ratio, parameters%normal_stiffness, record%unbalanced, record%stage + 1, record%energy
      call self%put(trim(text), error)
   end subroutine put_step

   !> Pass the lines to the operating system.
   subroutine flush_log(self, error)
      class(log_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call self%sink%flush(error)
   end subroutine flush_log

   !> Finish the log. Nothing happens when none is open.
   subroutine close_log(self, error)
      class(log_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      call self%sink%close(error)
   end subroutine close_log

   !> Text at the right end of a column.
   pure function right(text, width) result(column)
      character(len=*), intent(in) :: text
      integer, intent(in) :: width
      character(len=width) :: column
      column = adjustr(text//repeat(' ', max(0, width - len(text))))
   end function right

end module rockdda_io_log
