! SPDX-License-Identifier: MIT
!> The text log of a run: what was read, the numbers it runs with, and one line per reported step.
!>
!> It lies beside the results: OUT.log for OUT.h5.
module rockdda_io_log
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_base_strings, only : printable, to_string
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_state, only : step_record_type, n_energies, energy_names
   use rockdda_io_file_sink, only : file_sink_type
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
      logical, intent(in), optional :: append       !! true: go on at the end
      call self%sink%open(path, error, append=append)
   end subroutine open_log

   !> Write one line (or several, separated by line ends).
   subroutine put(self, text, error)
      class(log_type), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_type), allocatable, intent(out) :: error
      call self%sink%put(printable(text, achar(9)//new_line('a'))//new_line('a'), error)
   end subroutine put

   !> Notes and warnings met while reading and cutting.
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

   !> Size of the model.
   subroutine put_model(self, blocks, error)
      class(log_type), intent(inout) :: self
      type(block_system_type), intent(in) :: blocks
      type(error_type), allocatable, intent(out) :: error
      call self%put('model: '//to_string(blocks%n_blocks)//' blocks, '//to_string(blocks%n_vertices())// &
                    ' vertices, '//to_string(blocks%fixed%n)//' fixed points, '//to_string(blocks%loading%n)// &
                    ' loading points, '//to_string(blocks%measured%n)//' measured points, '// &
                    to_string(blocks%bolts%n)//' bolts', error)
   end subroutine put_model

   !> Every number that the run uses.
   subroutine put_parameters(self, parameters, error)
      class(log_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      call self%put('parameters:', error)
      call line('steps', whole_or(parameters%n_steps, 'no limit'))
      call line('end time', real_or(parameters%t_end, 'none'))
      call line('k01', number(parameters%k01))
      call line('largest time step (g1)', number(parameters%dt_max))
      call line('smallest time step', number(parameters%dt_min))
      call line('factor of a cut step', number(parameters%cut_factor))
      call line('open-close rounds at most', to_string(parameters%max_open_close))
      call line('displacement ratio (g2)', number(parameters%displacement_ratio))
      call line('reference length w0', number(parameters%w0))
      call line('rotation', words(parameters%exact_rotation, 'exact', 'linear'))
      call line('contact preset', words(parameters%peer_contacts, 'peer', 'none'))
      call line('contact stiffness, normal (g0)', number(parameters%normal_stiffness))
      call line('contact stiffness, shear', number(parameters%shear_stiffness))
      call line('stiffness of fixed points', number(parameters%fixed_stiffness))
      call line('contact search distance', number(parameters%search_distance))
      call line('angle tolerance [rad]', number(parameters%angle_tolerance))
      call line('closing tolerance', number(parameters%close_tolerance))
      call line('plane', words(parameters%plane_strain, 'strain', 'stress'))
      call line('mass', words(parameters%mass_from_area, 'from the area', 'of the start'))
      call line('mass-proportional damping', number(parameters%mass_damping))
      call line('gravity', real_or(merge(parameters%gravity, huge(1.0_wp), parameters%gravity >= 0), &
                                   'weight/density of each material'))
      call line('solver', parameters%solver_method)
      if (len(parameters%preconditioner) > 0) call line('preconditioner', parameters%preconditioner)
      call line('solver tolerance', number(parameters%solver_tolerance))
      call line('SOR factor', number(parameters%sor_factor))
      do i = 1, size(parameters%block_materials)
         associate (m => parameters%block_materials(i))
            call line('block material '//to_string(i), 'density '//number(m%density)//', weight '// &
                      number(m%weight)//', E '//number(m%youngs_modulus)//', nu '//number(m%poisson_ratio)// &
                      ', stress '//list(m%stress)//', its gradient with y '//list(m%stress_gradient)// &
                      ', velocity '//list(m%velocity))
         end associate
      end do
      do i = 1, size(parameters%joint_materials)
         associate (m => parameters%joint_materials(i))
            call line('joint material '//to_string(i), 'friction angle '//number(m%friction_angle)// &
                      ' deg, cohesion '//number(m%cohesion)//', tension '//number(m%tension))
         end associate
      end do
      do i = 1, size(parameters%joint_laws)
         associate (m => parameters%joint_laws(i))
            call line('law of joint material '//to_string(m%material), m%law//', damping ratio '// &
                      number(m%damping_ratio))
         end associate
      end do
      call line('line loads', to_string(size(parameters%line_loads)))
      do i = 1, size(parameters%stages)
         associate (m => parameters%stages(i))
            call line('stage '//to_string(i), 'until step '//whole_or(m%until_step, 'any')//', until time '// &
                      real_or(m%until_time, 'any')//', k01 '//real_or(m%k01, 'as before')//', gravity times '// &
                      number(m%gravity))
         end associate
      end do

   contains

      !> One "name = value" line, unless writing failed before.
      subroutine line(name, value)
         character(len=*), intent(in) :: name, value
         character(len=34) :: padded
         if (allocated(error)) return
         padded = name
         call self%put('  '//padded//' = '//value, error)
      end subroutine line

   end subroutine put_parameters

   !> The head of the table of steps.
   subroutine put_columns(self, error)
      class(log_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: head
      integer :: i
      head = '#     step          time            dt  tries rounds   solver     open  sliding   locked'// &
             '      disp/w0       penalty'
      do i = 1, n_energies
         head = head//' '//right(trim(energy_names(i)), 21)
      end do
      call self%put(head, error)
   end subroutine put_columns

   !> One line of the table: an accepted step.
   subroutine put_step(self, record, parameters, error)
      class(log_type), intent(inout) :: self
      type(step_record_type), intent(in) :: record
      type(parameters_type), intent(in) :: parameters
      type(error_type), allocatable, intent(out) :: error
      character(len=400) :: text
      real(wp) :: ratio
      ratio = 0
      if (parameters%w0 > 0) ratio = record%max_displacement/parameters%w0
      write (text, '(i10, 2es14.6, i7, i7, i9, 3i9, es13.4, es14.6, *(es22.13))') record%step, record%time, &
         record%dt, record%attempts, record%open_close_iterations, record%solver_iterations, record%contacts, &
         ratio, parameters%normal_stiffness, record%energy
      call self%put(trim(text), error)
   end subroutine put_step

   !> Hand the lines to the system.
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

   !> A real with enough digits to tell values apart.
   pure function number(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      text = to_string(value, 10)
   end function number

   !> Numbers between parentheses.
   pure function list(values) result(text)
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: text
      integer :: i
      text = '('
      do i = 1, size(values)
         if (i > 1) text = text//' '
         text = text//number(values(i))
      end do
      text = text//')'
   end function list

   !> The value, or words for one that is as good as infinite or was not given.
   pure function real_or(value, otherwise) result(text)
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: otherwise
      character(len=:), allocatable :: text
      text = otherwise
      if (abs(value) < 0.5_wp*huge(value)) text = number(value)
   end function real_or

   !> The value, or words for one that is as good as infinite or was not given.
   pure function whole_or(value, otherwise) result(text)
      integer, intent(in) :: value
      character(len=*), intent(in) :: otherwise
      character(len=:), allocatable :: text
      text = otherwise
      if (abs(value) < huge(value)) text = to_string(value)
   end function whole_or

   !> One of two words.
   pure function words(condition, yes, no) result(text)
      logical, intent(in) :: condition
      character(len=*), intent(in) :: yes, no
      character(len=:), allocatable :: text
      text = no
      if (condition) text = yes
   end function words

   !> Text at the right end of a column.
   pure function right(text, width) result(column)
      character(len=*), intent(in) :: text
      integer, intent(in) :: width
      character(len=width) :: column
      column = adjustr(text//repeat(' ', max(0, width - len(text))))
   end function right

end module rockdda_io_log
