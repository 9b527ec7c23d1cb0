! SPDX-License-Identifier: MIT
!> Continues a run from its checkpoint to its end with each constant of the method (rockdda_stepping_method) halved and
!> doubled, and prints what becomes of the answer.
!>
!>     bench_constants CHECKPOINT END_TIME
!>
!> A line for each: constant, its value, largest difference of a vertex from the run with the usual constants over the
!> largest displacement of that run, steps and rounds of both. Instead of the difference: `fails`, when a step cannot be
!> solved or a stage does not come to rest, and `unfinished` after many steps. Runs that do not end with their stages
!> end at END_TIME. scripts/constants makes a table of the lines of several models.
program bench_constants
   use, intrinsic :: iso_fortran_env, only : error_unit
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type
   use rockdda_io_digest, only : digest_length
   use rockdda_run_checkpointing, only : load_checkpoint
   use rockdda_stepping_method, only : method_type, constant_names, scale_constant
   use rockdda_stepping_simulation, only : simulation_type
   implicit none

   !> The end of a run.
   type :: answer_type
      character(len=10) :: outcome = 'finished'
      integer :: steps = 0, rounds = 0
      real(wp), allocatable :: vertices(:, :)   !! (2, nv)
   end type answer_type

   real(wp), parameter :: factors(2) = [0.5_wp, 2.0_wp]
   integer, parameter :: most_steps = 5000
   character(len=1000) :: argument
   type(method_type) :: method
   type(answer_type) :: usual, other
   real(wp) :: end_time, largest, value
   integer :: i, k, status
   logical :: known

   call get_command_argument(2, argument)
   read (argument, *, iostat=status) end_time
   if (status /= 0) error stop 'usage: bench_constants CHECKPOINT END_TIME'
   call get_command_argument(1, argument)
   call finish(method_type(), usual, largest)
   if (usual%outcome /= 'finished') then
      write (error_unit, '(a)') 'bench_constants: the run with the usual constants '//trim(usual%outcome)
      error stop 1
   end if
   do i = 1, size(constant_names)
      do k = 1, size(factors)
         method = method_type()
         call scale_constant(trim(constant_names(i)), factors(k), method, value, known)
         if (.not. known) error stop 'bench_constants: unknown constant'
         call finish(method, other)
         if (other%outcome == 'finished') &
            write (other%outcome, '(es9.2)') maxval(norm2(other%vertices - usual%vertices, 1))/largest
         print '(a, f5.1, es10.2, 2x, a, 4i8)', constant_names(i), factors(k), value, other%outcome, other%steps, &
            usual%steps, other%rounds, usual%rounds
      end do
   end do

contains

   !> Continue the run to its end.
   subroutine finish(with, answer, moved)
      type(method_type), intent(in) :: with
      type(answer_type), intent(out) :: answer
      real(wp), intent(out), optional :: moved   !! largest displacement of a vertex since the start
      type(simulation_type), allocatable :: sim
      type(checkpoint_facts_type) :: facts
      type(error_type), allocatable :: error
      character(len=digest_length) :: digest
      allocate (sim)
      call load_checkpoint(trim(argument), sim, facts, digest, error)
      if (allocated(error)) then
         write (error_unit, '(a)') error%message
         error stop 1
      end if
      sim%parameters%n_steps = huge(1)
      if (.not. sim%parameters%ends_with_stages) sim%parameters%t_end = end_time
      sim%control%method = with
      do while (.not. sim%is_finished())
         call sim%advance(error)
         if (allocated(error)) then
            answer%outcome = 'fails'
            exit
         end if
         answer%rounds = answer%rounds + sim%record%open_close_iterations
         if (sim%state%step < most_steps) cycle
         answer%outcome = 'unfinished'
         exit
      end do
      answer%steps = sim%state%step
      answer%vertices = sim%state%vertices
      if (present(moved)) moved = maxval(norm2(sim%state%vertices - sim%blocks%vertices, 1))
   end subroutine finish

end program bench_constants
