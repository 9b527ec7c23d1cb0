! SPDX-License-Identifier: MIT
!> Memory bandwidth with the compiler and threads of the program: one JSON line.
!>
!>     bench_memory [THREADS [MEGABYTES]]
!>
!> copies are a = b, triads a = b + s c (McCalpin's STREAM: 16 and 24 bytes for each element), sums read an array only
!> (8 bytes). Arrays of 256 MB each, more than any cache here; the best of ten passes.
program bench_memory
   use, intrinsic :: iso_fortran_env, only : output_unit
!$ use omp_lib, only : omp_set_num_threads
   use rockdda_base_kinds, only : wp
   use bench_clock, only : stopwatch_type
   use bench_lines, only : line_type
   implicit none
   integer, parameter :: n_passes = 10
   real(wp), allocatable :: a(:), b(:), c(:)
   real(wp) :: copy, triad, read, total, lane(8)
   type(stopwatch_type) :: watch
   type(line_type) :: line
   integer :: n, i, pass, threads, megabytes

   threads = argument(1, 1)
   megabytes = argument(2, 256)
!$ call omp_set_num_threads(threads)
   n = 8*(megabytes*(1024*1024/8)/8)
   allocate (a(n), b(n), c(n))
   !$omp parallel do default(none) shared(a, b, c, n) schedule(static)
   do i = 1, n
      a(i) = 0
      b(i) = 1 + mod(i, 7)
      c(i) = 2
   end do
   !$omp end parallel do
   copy = 0
   triad = 0
   read = 0
   do pass = 1, n_passes
      call watch%start()
      !$omp parallel do default(none) shared(a, b, n) schedule(static)
      do i = 1, n
         a(i) = b(i)
      end do
      !$omp end parallel do
      call watch%stop()
      copy = max(copy, 16.0_wp*n/watch%wall)
      call watch%start()
      !$omp parallel do default(none) shared(a, b, c, n) schedule(static)
      do i = 1, n
         a(i) = b(i) + 3*c(i)
      end do
      !$omp end parallel do
      call watch%stop()
      triad = max(triad, 24.0_wp*n/watch%wall)
      lane = 0
      call watch%start()
      !$omp parallel do default(none) shared(b, n) schedule(static) reduction(+:lane)
      do i = 1, n, 8
         lane = lane + b(i:i + 7)
      end do
      !$omp end parallel do
      call watch%stop()
      read = max(read, 8.0_wp*n/watch%wall)
   end do
   total = sum(lane) + sum(a(1:n:n/8))
   call line%integer('threads', threads)
   call line%integer('megabytes', megabytes)
   call line%real('copy', copy)
   call line%real('triad', triad)
   call line%real('read', read)
   call line%real('sum', total)
   call line%put(output_unit)

contains

   !> Integer argument of the command line.
   integer function argument(k, default)
      integer, intent(in) :: k, default
      character(len=32) :: text
      argument = default
      call get_command_argument(k, text)
      if (len_trim(text) > 0) read (text, *) argument
   end function argument

end program bench_memory
