! SPDX-License-Identifier: MIT
!> Runs a model step by step and prints the cost of each step: one JSON object per line on standard output.
!>
!>     bench_steps MODEL [NAME=VALUE ...]
!>
!>   blocks=1000       approximate number of blocks
!>   ratio=1           wall: contact stiffness over 2m/dt^2
!>   softness=0.1      contact stiffness over E
!>   steps=5           number of steps
!>   threads=1         OpenMP threads
!>   solver=auto       auto, pcg, cholmod, sor, dense; preconditioner=, tolerance= as in the options file
!>   k01=, dt=, stiffness=   instead of the model's values
!>   formulation=, rotation=, preset=   as in the options file
!>   output=FILE       write results: history in each step, frame in the last
!>   matrix=FILE       write the matrix and load of the last solve (native binary, see write_matrix)
!>   passes=0          number of timed passes of K x and of PCG on that matrix
!>
!> First line: the model. Then one line for each step. Last line: memory, checksum of the final state, passes.
!> Seconds are given on the wall clock, as processor time of all threads, and of the first thread alone.
program bench_steps
   use, intrinsic :: iso_fortran_env, only : output_unit, error_unit
!$ use omp_lib, only : omp_set_num_threads
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_base_phase_times, only : phase_times_type, n_phases, phase_names
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_contact_view, only : contact_view_type
   use rockdda_linear_matrix, only : n_stored_blocks
   use rockdda_io_results, only : results_type, results_header_type
   use rockdda_stepping_simulation, only : simulation_type
   use bench_models, only : make_model
   use bench_clock, only : stopwatch_type, resident_bytes
   use bench_lines, only : line_type
   use bench_matrix, only : write_matrix, time_passes
   implicit none

   type(simulation_type) :: sim
   type(block_system_type) :: blocks
   type(parameters_type) :: parameters
   type(run_options_type) :: options
   type(error_type), allocatable :: error
   type(stopwatch_type) :: watch, writing
   type(phase_times_type) :: times_before
   type(line_type) :: line
   type(results_type) :: results
   character(len=:), allocatable :: model, output_file, matrix_file
   type(contact_view_type) :: view
   real(wp), allocatable :: stress(:, :)
   integer(i8) :: bytes_before
   integer :: n_wanted, n_steps, n_threads, n_passes, i, last
   real(wp) :: ratio, softness

   call read_arguments()
!$ call omp_set_num_threads(n_threads)
   bytes_before = resident_bytes('VmRSS:')
   call watch%start()
   call make_model(model, n_wanted, ratio, softness, options, blocks, parameters, error)
   call stop_on(error)
   call watch%stop()
   call line%text('model', model)
   call line%integer('blocks', blocks%n_blocks)
   call line%integer('vertices', blocks%n_vertices())
   call line%integer8('bytes_before_make', bytes_before)
   call line%real('dt', parameters%dt_max)
   call line%real('stiffness', parameters%normal_stiffness)
   call line%real('k01', parameters%k01)
   call line%integer('threads', n_threads)
   call line%real('make_seconds', watch%wall)
   call watch%start()
   call sim%init(blocks, parameters, error)
   call stop_on(error)
   call watch%stop()
   call line%text('solver', trim(parameters%solver_method))
   call line%real('ratio', stiffness_ratio())
   call line%real('init_seconds', watch%wall)
   call line%put(output_unit)
   if (len(output_file) > 0) then
      call results%create(output_file, .true., results_header(), blocks, sim%state, error)
      if (.not. allocated(error)) call results%publish(error)
      call stop_on(error)
   end if

   do i = 1, n_steps
      times_before = sim%times
      call watch%start()
      call sim%advance(error)
      call watch%stop()
      call stop_on(error)
      writing = stopwatch_type()
      if (len(output_file) > 0) call save(i == n_steps)
      call put_step()
   end do
   if (len(output_file) > 0) call results%close(.true., 'finished', error)
   call stop_on(error)
   call line%integer8('peak_bytes', resident_bytes('VmHWM:'))
   call line%text('checksum', checksum())
   if (len(matrix_file) > 0) call write_matrix(matrix_file, sim%equations%matrix, sim%equations%f, sim%equations%x)
   if (n_passes > 0) call time_passes(sim%equations%matrix, sim%equations%f, parameters%solver_tolerance, &
                                      n_passes, line)
   call line%put(output_unit)

contains

   !> Read the command line.
   subroutine read_arguments()
      character(len=:), allocatable :: argument, name, value
      integer :: k, length, at
      model = ''
      output_file = ''
      matrix_file = ''
      n_wanted = 1000
      n_steps = 5
      n_threads = 1
      n_passes = 0
      ratio = 1
      softness = 0.1_wp
      options%method = 'auto'
      do k = 1, command_argument_count()
         call get_command_argument(k, length=length)
         argument = repeat(' ', length)
         call get_command_argument(k, argument)
         at = index(argument, '=')
         if (at == 0) then
            model = argument
            cycle
         end if
         name = argument(1:at - 1)
         value = argument(at + 1:)
         select case (name)
         case ('blocks')
            read (value, *) n_wanted
         case ('ratio')
            read (value, *) ratio
         case ('softness')
            read (value, *) softness
         case ('steps')
            read (value, *) n_steps
         case ('threads')
            read (value, *) n_threads
         case ('passes')
            read (value, *) n_passes
         case ('solver')
            options%method = value
         case ('preconditioner')
            options%preconditioner = value
         case ('tolerance')
            read (value, *) options%tolerance
         case ('k01')
            read (value, *) options%k01
         case ('dt')
            read (value, *) options%dt_max
         case ('stiffness')
            read (value, *) options%stiffness
         case ('formulation')
            options%formulation = value
         case ('rotation')
            options%rotation = value
         case ('preset')
            options%preset = value
         case ('output')
            output_file = value
         case ('matrix')
            matrix_file = value
         case default
            write (error_unit, '(a)') "bench_steps: unknown option '"//name//"'"
            error stop 2
         end select
      end do
      if (len(model) == 0) then
         write (error_unit, '(a)') 'usage: bench_steps MODEL [NAME=VALUE ...], see the head of bench_steps.f90'
         error stop 2
      end if
   end subroutine read_arguments

   !> Header of the results file, as the program writes it.
   function results_header() result(header)
      type(results_header_type) :: header
      header%title = model
      header%created = ''
      header%program_version = ''
      header%geometry = ''
      header%analysis = ''
      header%config = ''
   end function results_header

   !> Write the rows of a step to the results, and a frame if requested.
   subroutine save(with_frame)
      logical, intent(in) :: with_frame
      call writing%start()
      call results%append_history(sim%record)
      call stop_on(error)
      if (with_frame) then
         call sim%contact_slab(1, sim%contacts%n, last, view, stress)
         call results%append_frame(sim%state, sim%contacts%n, [real(wp) ::], error)
         call stop_on(error)
         call results%append_contacts(sim%state%datum, view, stress, error)
         call stop_on(error)
         call results%flush(error)
         call stop_on(error)
      end if
      call writing%stop()
   end subroutine save

   !> Print the line of a step.
   subroutine put_step()
      integer :: k
      call line%integer('step', sim%record%step)
      call line%real('wall', watch%wall)
      call line%real('cpu', watch%cpu)
      call line%real('first_thread', watch%first_thread)
      call line%real('output', writing%cpu)
      call line%integer('rounds', sim%record%open_close_iterations)
      call line%integer('attempts', sim%record%attempts)
      call line%integer8('solves', sim%times%rounds - times_before%rounds)
      call line%integer8('assembled', sim%times%assembled - times_before%assembled)
      call line%integer('iterations', sim%record%solver_iterations)
      call line%integer('contacts', sim%contacts%n)
      call line%integer('closed', sim%record%contacts(2) + sim%record%contacts(3))
      call line%integer('sliding', sim%record%contacts(2))
      call line%integer('stored', n_stored_blocks(sim%equations%matrix))
      call line%real('dt', sim%record%dt)
      call line%real('displacement', sim%record%max_displacement)
      call line%open('phases')
      do k = 1, n_phases
         call line%real(trim(phase_names(k)), sim%times%seconds(k) - times_before%seconds(k))
      end do
      call line%close()
      call line%put(output_unit)
   end subroutine put_step

   !> Contact stiffness over 2m/dt^2, m being the mean mass of the blocks that are not held.
   real(wp) function stiffness_ratio()
      logical :: is_free(blocks%n_blocks)
      is_free = .true.
      is_free(blocks%fixed%block(1:blocks%fixed%n)) = .false.
      stiffness_ratio = parameters%normal_stiffness*parameters%dt_max**2/ &
                        (2*sum(sim%state%mass, mask=is_free)/max(1, count(is_free)))
   end function stiffness_ratio

   !> Checksum of all bits of the moving state, in sixteen hexadecimal digits.
   function checksum() result(text)
      character(len=16) :: text
      integer(i8) :: hash
      hash = 1469598103934665603_i8
      call mix(reshape(sim%state%vertices, [size(sim%state%vertices)]), hash)
      call mix(reshape(sim%state%velocity, [size(sim%state%velocity)]), hash)
      call mix(reshape(sim%state%stress, [size(sim%state%stress)]), hash)
      call mix(sim%contacts%normal_force(1:sim%contacts%n), hash)
      call mix(sim%contacts%shear(1:sim%contacts%n), hash)
      call mix(sim%record%energy, hash)
      write (text, '(z16.16)') hash
   end function checksum

   !> Combine the checksum with all words of an array.
   pure subroutine mix(values, hash)
      real(wp), intent(in) :: values(:)
      integer(i8), intent(inout) :: hash
      integer :: k
      do k = 1, size(values)
         hash = ieor(ishftc(hash, 13), transfer(values(k), hash))
         hash = ieor(hash, ishft(hash, -29))
      end do
   end subroutine mix

   !> Print an error and stop.
   subroutine stop_on(failure)
      type(error_type), allocatable, intent(in) :: failure
      if (.not. allocated(failure)) return
      write (error_unit, '(a)') 'bench_steps: '//failure%message
      error stop 1
   end subroutine stop_on

end program bench_steps
