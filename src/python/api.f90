! SPDX-License-Identifier: MIT
!> The flat layer under the Python extension `_rockdda` (f2py): operations of a session. rockdda_python_values returns
!> its data.
!>
!> A handle is the number of a session (session.f90); Python owns it and passes nothing else. `status` is 0 or an error
!> code of rockdda_base_error; the messages are then fetched as text (`text_size`, `get_text`). -1 means a whole
!> number that was not given, a negative number for a real one. The lines `!f2py threadsafe` mark procedures that run
!> without the lock of the interpreter. This file is plain ASCII, which f2py needs.
module rockdda_python_api
   ! f2py does not parse `use, intrinsic`
   ! allow(C122)
   use iso_c_binding, only : c_int, c_int64_t, c_double
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_code, make_error
   use rockdda_base_version, only : version, build_description
   use rockdda_model_quake_options, only : form_of
   use rockdda_model_state, only : n_energies, energy_names
   use rockdda_io_block_writer, only : write_block_file, write_geometry_file
   use rockdda_io_option_documents, only : options_schema
   use rockdda_io_recognise, only : file_kind
   use rockdda_io_record_file, only : read_record
   use rockdda_io_separators, only : settle_separators
   use rockdda_io_source, only : source_type, new_source, read_source
   use rockdda_run_labelled_text, only : labelled_text
   use rockdda_run_find_files, only : find_files, recognise_file
   use rockdda_run_model_input, only : read_model
   use rockdda_run_read_files, only : read_blocks
   use rockdda_python_session, only : session_type, new_session, get_session, drop_session, messages_text
   implicit none
   private
   public :: create, destroy, request, act, motion_sizes, advance, text_size, get_text

   ! the build stops here if the reals of the library are not those of C
   integer, parameter :: same_kind = 1/merge(1, 0, wp == c_double)

contains

   !> Create a session.
   subroutine create(handle)
      integer(c_int64_t), intent(out) :: handle
      call new_session(handle)
   end subroutine create

   !> Delete a session; its handle is invalid afterwards.
   subroutine destroy(handle)
      integer(c_int64_t), intent(in) :: handle
      !f2py threadsafe
      call drop_session(handle)
   end subroutine destroy

   !> Set the options of the run beside the files. Texts may be empty.
   subroutine request(handle, output, solver, dialect, threads, steps, save_every, t_end, max_wall, checkpoint_every, &
                      strict, allow_open, force)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: output, solver
      integer(c_int), intent(in) :: dialect                     !! 0 auto, 1 dda_windows, 2 g0
      integer(c_int), intent(in) :: threads, steps, save_every
      real(c_double), intent(in) :: t_end, max_wall, checkpoint_every
      integer(c_int), intent(in) :: strict, allow_open, force   !! 0 or 1
      type(session_type), pointer :: session
      call get_session(handle, session)
      session%request%output = output
      session%request%solver = solver
      session%request%dialect = dialect
      if (threads > 0) session%request%threads = threads
      if (steps >= 0) session%request%steps = steps
      if (save_every > 0) session%request%save_every = save_every
      if (t_end > 0) session%request%t_end = t_end
      if (max_wall > 0) session%request%max_wall = max_wall
      if (checkpoint_every > 0) session%request%checkpoint_every = checkpoint_every
      session%request%strict = strict /= 0
      session%request%allow_open = allow_open /= 0
      session%request%force = force /= 0
   end subroutine request

   !> Do what `operation` names, with its texts, one after another, and whole numbers:
   !>
   !>     read_files     model, analysis, options; analysis empty: a folder or a labelled file; cuts a geometry
   !>     read_texts     their names, for messages, and their contents. Empty options have an empty name; without a name
   !>                    of the analysis file the options are a labelled file
   !>     cut_file       a geometry file, or a block file, which is read; 1: open outlines are warnings
   !>     cut_text       the same of a geometry in memory: name, content
   !>     read_motion    a record of ground motion: path, form ('csv', 'at2', or empty: by the ending), column (empty:
   !>                    the second); 1: a factor of the values is given
   !>     plain_table    path of a table; numbers of a row, and of which they are a multiple. Its separators become
   !>                    those of all tables that the program reads (text 17): blanks or commas, points as decimal signs
   !>     write_blocks   path of a block file
   !>     draw_file      a joint statistics file; seed, -1: that of the file
   !>     draw_text      the same in memory: name, content
   !>     write_network  path of a geometry file, for the lines that were drawn
   !>     start          1: open results. The simulation gets its state at time 0
   !>     finish         why the results are closed, stored for a run that has not reached its end
   subroutine act(handle, operation, text, n_texts, ends, n_numbers, numbers, status)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: operation
      character(len=*), intent(in) :: text                      !! all texts
      integer(c_int), intent(in) :: n_texts, n_numbers          !! one more than there are
      integer(c_int), intent(in) :: ends(n_texts)               !! 0, and where each text ends
      integer(c_int), intent(in) :: numbers(n_numbers)          !! 0, and the numbers
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      type(source_type) :: source
      integer :: kind
      logical :: ok
      !f2py threadsafe
      call get_session(handle, session)
      associate (s => session, input => session%input)
         select case (operation)
         case ('read_files')
            call find_files(part(1), part(2), part(3), input, s%messages, s%error)
            if (s%status() == 0) call read_model(s%request, input, s%messages, s%error)
         case ('read_texts')
            input%in_memory = .true.
            input%labelled = len(part(2)) == 0
            input%model_kind = file_kind%geometry
            input%model_file = part(1)
            input%analysis_file = part(2)
            input%config_file = part(3)
            input%model_text = part(4)
            input%analysis_text = part(5)
            input%config_text = part(6)
            call read_model(s%request, input, s%messages, s%error)
         case ('cut_file')
            input%model_file = part(1)
            call recognise_file(input%model_file, input%model_kind, s%messages, ok)
            if (ok .and. input%model_kind /= file_kind%geometry .and. input%model_kind /= file_kind%blocks) &
               call make_error(s%error, error_code%input, part(1)//': error: expected a geometry or block file')
            input%options%allow_open = numbers(2) /= 0
            if (s%status() == 0) call read_blocks(input, s%messages, s%error)
         case ('cut_text')
            input%in_memory = .true.
            input%model_kind = file_kind%geometry
            input%model_file = part(1)
            input%model_text = part(2)
            input%options%allow_open = numbers(2) /= 0
            call read_blocks(input, s%messages, s%error)
         case ('read_motion')
            call read_record(part(1), form_of(part(2), part(1)), part(3), numbers(2) /= 0, s%motion, s%motion_unit, &
                             s%messages)
         case ('plain_table')
            call read_source(part(1), s%table, s%messages, ok)
            if (ok) call settle_separators(s%table, int(numbers(2)), int(numbers(3)), s%messages, ok)
         case ('write_blocks')
            call write_block_file(part(1), input%blocks, s%error)
         case ('draw_file')
            call recognise_file(part(1), kind, s%messages, ok)
            if (ok .and. kind /= file_kind%statistics) &
               call make_error(s%error, error_code%input, part(1)//': error: expected a joint statistics file')
            if (s%status() == 0) call read_source(part(1), source, s%messages, ok)
            call s%draw(source, int(numbers(2)))
         case ('draw_text')
            call new_source(part(1), part(2), source)
            call s%draw(source, int(numbers(2)))
         case ('write_network')
            call write_geometry_file(part(1), input%geometry, s%error)
         case ('start')
            call s%start(numbers(2) /= 0)
         case ('finish')
            call s%finish(part(1))
         case default
            call make_error(s%error, error_code%internal, 'the extension does not '//operation)
         end select
         status = s%status()
      end associate

   contains

      !> Text k.
      pure function part(k)
         integer, intent(in) :: k
         character(len=:), allocatable :: part
         part = text(ends(k) + 1:ends(k + 1))
      end function part

   end subroutine act

   !> Rows of the record that was read, and the unit of its values [m/s^2], 0 where the file names none.
   subroutine motion_sizes(handle, n, unit)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: n
      real(c_double), intent(out) :: unit
      type(session_type), pointer :: session
      call get_session(handle, session)
      n = 0
      if (allocated(session%motion)) n = size(session%motion, 2)
      unit = session%motion_unit
   end subroutine motion_sizes

   !> Compute at most n_steps steps, and start none after a number of seconds. Results are closed on failure only.
   subroutine advance(handle, n_steps, seconds, n_done, finished, status)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_steps
      real(c_double), intent(in) :: seconds
      integer(c_int), intent(out) :: n_done
      integer(c_int), intent(out) :: finished                   !! 1: the run has reached its last step or end time
      integer(c_int), intent(out) :: status
      type(session_type), pointer :: session
      !f2py threadsafe
      call get_session(handle, session)
      call session%advance(n_steps, seconds, n_done)
      finished = merge(1_c_int, 0_c_int, session%run%sim%is_finished())
      status = session%status()
   end subroutine advance

   !> Prepare a text for `get_text`; returns its length in bytes. Which: 1 all messages (see messages_text), 2 the
   !> last failure, 3 path of the results, 4 path of the log, 5 why the run ended, 6 title, 7 version, 8 build,
   !> 9 names of the energies, one on each line, 10 geometry or block file, 11 analysis file, 12 options file,
   !> 13 content of the options file, 14 messages with one for many of a kind, 15 schema of the options, 16 the labelled
   !> file of a model that was read without errors, 17 a table with plain separators.
   subroutine text_size(handle, which, n)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: which
      integer(c_int), intent(out) :: n
      type(session_type), pointer :: session
      integer :: i
      call get_session(handle, session)
      associate (s => session)
         s%text = ''
         select case (which)
         case (1); s%text = messages_text(s%messages)
         case (14); s%text = messages_text(s%messages%summarised())
         case (2); if (allocated(s%error)) s%text = s%error%message
         case (3); if (allocated(s%run%output)) s%text = s%run%output
         case (4); if (allocated(s%run%log_file)) s%text = s%run%log_file
         case (5); if (allocated(s%run%reason)) s%text = s%run%reason
         case (6); if (allocated(s%input%parameters%title)) s%text = s%input%parameters%title
         case (7); s%text = version
         case (8); s%text = build_description()
         case (10); if (allocated(s%input%model_file)) s%text = s%input%model_file
         case (11); if (allocated(s%input%analysis_file)) s%text = s%input%analysis_file
         case (12); if (allocated(s%input%config_file)) s%text = s%input%config_file
         case (13); if (allocated(s%input%config_text)) s%text = s%input%config_text
         case (15); s%text = options_schema()
         case (17); if (allocated(s%table%text)) s%text = s%table%text
         case (16); if (s%input%has_blocks .and. s%status() == 0) s%text = labelled_text(s%input)//new_line('a')
         case default
            do i = 1, n_energies
               s%text = s%text//trim(energy_names(i))//new_line('a')
            end do
         end select
         n = len(s%text)
      end associate
   end subroutine text_size

   !> The text that `text_size` prepared, byte by byte.
   subroutine get_text(handle, n, codes)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: codes(n)                   !! 0 ... 255
      type(session_type), pointer :: session
      integer :: i
      call get_session(handle, session)
      do i = 1, min(n, len(session%text))
         codes(i) = ichar(session%text(i:i))
      end do
   end subroutine get_text

end module rockdda_python_api
