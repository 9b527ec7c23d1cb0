! SPDX-License-Identifier: MIT
!> Number of threads of a run for which the user chose none: by the size of the model, and by what other programs leave
!> free of the cores. It may change from step to step, because results do not depend on it.
module rockdda_run_thread_choice
!$ use omp_lib, only : omp_set_num_threads
   use rockdda_base_kinds, only : wp
   use rockdda_io_timestamp, only : wall_seconds
   use rockdda_io_cores, only : core_times_type, cores_allowed, read_core_times, sleep_seconds
   implicit none
   private
   public :: thread_choice_type, threads_for_size, threads_for_load

   !> Blocks for each thread: with fewer, threads wait for each other longer than they compute.
   integer, parameter :: blocks_of_thread = 1000
   !> Time over which the load is measured at the start, and between two measurements [s]. The system counts in
   !> hundredths of a second.
   real(wp), parameter :: first_interval = 0.06_wp, interval = 1
   !> A core that is free for this part of the time counts as free.
   real(wp), parameter :: free_part = 0.75_wp

   type :: thread_choice_type
      integer, private :: most = 1            !! by the size and the allowed cores
      integer, private :: n = 0               !! at present; 0: that of OpenMP stays
      type(core_times_type), private :: last  !! at the last measurement
      real(wp), private :: renewed = 0        !! wall clock then
   contains
      procedure :: start
      procedure :: apply
      procedure :: renew
   end type thread_choice_type

contains

   !> Largest number of threads that is of use for a model.
   pure integer function threads_for_size(n_blocks, n_cores)
      integer, intent(in) :: n_blocks, n_cores
      threads_for_size = max(1, min(n_cores, n_blocks/blocks_of_thread))
   end function threads_for_size

   !> Number of threads by the load between two moments: what this process had of the cores, and what nobody had.
   pure integer function threads_for_load(before, after, most)
      type(core_times_type), intent(in) :: before, after
      integer, intent(in) :: most
      real(wp) :: passed
      threads_for_load = most
      passed = after%now - before%now
      if (.not. (before%is_known .and. after%is_known) .or. passed <= 0) return
      threads_for_load = max(1, min(most, int((after%own - before%own + after%idle - before%idle)/passed + &
                                              1 - free_part)))
   end function threads_for_load

   !> Set the number of threads for a model: the wish of the user, by an option or by OMP_NUM_THREADS, or a choice.
   subroutine start(self, n_blocks, wish)
      class(thread_choice_type), intent(inout) :: self
      integer, intent(in) :: n_blocks
      integer, intent(in) :: wish             !! of an option; below 1: none
      type(core_times_type) :: before
      integer :: length
      self%most = 1
      self%n = max(0, wish)
      if (wish > 0) then
         call self%apply()
         return
      end if
      call get_environment_variable('OMP_NUM_THREADS', length=length)
      if (length > 0) return
      self%most = threads_for_size(n_blocks, cores_allowed())
      self%n = self%most
      if (self%most > 1) then
         before = read_core_times()
         call sleep_seconds(first_interval)
         self%last = read_core_times()
         self%n = threads_for_load(before, self%last, self%most)
      end if
      call self%apply()
   end subroutine start

   !> Set the number of threads that was chosen last for the calling thread.
   subroutine apply(self)
      class(thread_choice_type), intent(in) :: self
!$    if (self%n > 0) call omp_set_num_threads(self%n)
   end subroutine apply

   !> Choose again, between two steps, when the load has been measured long enough.
   subroutine renew(self)
      class(thread_choice_type), intent(inout) :: self
      type(core_times_type) :: times
      real(wp) :: now
      integer :: n
      if (self%most == 1) return
      now = wall_seconds()
      if (abs(now - self%renewed) < interval) return
      self%renewed = now
      times = read_core_times()
      n = threads_for_load(self%last, times, self%most)
      self%last = times
      if (n == self%n) return
      self%n = n
      call self%apply()
   end subroutine renew

end module rockdda_run_thread_choice
