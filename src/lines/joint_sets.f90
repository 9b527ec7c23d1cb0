! SPDX-License-Identifier: MIT
!> Traces of one joint set, before they are clipped to the rock.
!>
!> Shi and Goodman's one-dimensional perturbation ("The key blocks of unrolled joint traces in developed maps of
!> tunnel walls", Int. J. Numer. Anal. Methods Geomech. 13, 1989; thesis 7.1): every line of a lattice moves by
!> (2u-1) D_r S along the normal, the first trace of a line is shifted by (2u-1) D_r (L+B), each length is
!> L (1 + (2u-1) D_r) and each bridge B (1 + (2u-1) D_r), with u uniform in (0,1). D_r = 0 is the lattice itself;
!> D_r = 1/2 allows a line anywhere between the midpoints to its neighbours.
module rockdda_lines_joint_sets
   use rockdda_base_kinds, only : wp
   use rockdda_base_room, only : grow
   use rockdda_base_random, only : random_stream_type
   use rockdda_lines_statistics, only : joint_set_type, law
   implicit none
   private
   public :: direction_of, line_positions, line_traces, is_endless

   !> Lines of irregular spacing (and traces of irregular length) begin this many means outside, so that the lines in
   !> the region do not depend on the starting point.
   integer, parameter :: lead = 20

contains

   !> Unit vector of an angle in degrees; exact for multiples of 90.
   pure function direction_of(angle) result(t)
      real(wp), intent(in) :: angle   !! [deg]
      real(wp) :: t(2)
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp) :: rest
      integer :: quarter
      rest = modulo(angle, 360.0_wp)
      quarter = nint(rest/90)
      rest = (rest - 90*quarter)*pi/180
      t = [cos(rest), sin(rest)]
      select case (modulo(quarter, 4))
      case (1); t = [-t(2), t(1)]
      case (2); t = -t
      case (3); t = [t(2), -t(1)]
      end select
   end function direction_of

   !> Are the traces of the set as long as the region?
   pure logical function is_endless(set)
      type(joint_set_type), intent(in) :: set
      is_endless = set%trace >= huge(1.0_wp)
   end function is_endless

   !> A length of the given mean.
   subroutine varied(stream, mean, kind, randomness, value)
      type(random_stream_type), intent(inout) :: stream
      real(wp), intent(in) :: mean
      integer, intent(in) :: kind              !! one of law%...
      real(wp), intent(in) :: randomness       !! D_r or coefficient of variation; 0: the mean itself
      real(wp), intent(out) :: value
      real(wp) :: z, s
      value = mean
      if (.not. randomness > 0 .or. .not. mean > 0) return
      if (kind == law%uniform) then
         call stream%uniform(z)
         value = mean*(1 + (2*z - 1)*randomness)
      else if (kind == law%normal) then
         ! lengths are positive: values outside (0, 2 mean) are drawn again, which preserves the mean
         do
            call stream%normal(z)
            if (.not. abs(randomness*z) >= 1) exit
         end do
         value = mean*(1 + randomness*z)
      else if (kind == law%lognormal) then
         call stream%normal(z)
         s = sqrt(log(1 + randomness**2))
         value = mean*exp(s*z - 0.5_wp*s**2)
      else
         call stream%exponential(z)
         value = mean*z
      end if
   end subroutine varied

   !> Ascending positions of the lines on the normal of the set, slightly beyond [low, high] at both ends.
   subroutine line_positions(set, shift, low, high, stream, positions, first)
      type(joint_set_type), intent(in) :: set
      real(wp), intent(in) :: shift            !! of the lattice, beside set%offset [L]
      real(wp), intent(in) :: low, high        !! interval of the normal to cover [L]
      type(random_stream_type), intent(inout) :: stream
      real(wp), allocatable, intent(out) :: positions(:)
      integer, intent(out) :: first            !! number of the first line: line k = 0 of a lattice is at set%offset
      real(wp) :: base, u, gap
      integer :: k, last, n
      base = set%offset + shift
      first = floor((low - base)/set%spacing) - 1
      if (set%spacing_law == law%uniform .or. .not. set%randomness > 0) then
         last = ceiling((high - base)/set%spacing) + 1
         allocate (positions(last - first + 1))
         do k = first, last
            u = 0.5_wp
            if (set%randomness > 0) call stream%uniform(u)
            positions(k - first + 1) = base + k*set%spacing + (2*u - 1)*set%randomness*set%spacing
         end do
         return
      end if
      allocate (positions(64))
      n = 1
      positions(1) = base + (first - lead)*set%spacing
      do while (positions(n) < high)
         call varied(stream, set%spacing, set%spacing_law, set%randomness, gap)
         call grow(positions, n + 1)
         positions(n + 1) = positions(n) + gap
         n = n + 1
      end do
      k = 1
      do while (positions(k + 1) < low)
         k = k + 1
      end do
      positions = positions(k:n)
   end subroutine line_positions

   !> Traces of one line as intervals along it, covering [low, high].
   subroutine line_traces(set, number, low, high, stream, traces)
      type(joint_set_type), intent(in) :: set
      integer, intent(in) :: number                     !! of the line
      real(wp), intent(in) :: low, high                 !! interval of the line to cover [L]
      type(random_stream_type), intent(inout) :: stream
      real(wp), allocatable, intent(out) :: traces(:, :) !! (2, n) beginning and end of each
      real(wp) :: cell, phase, at, u, length, gap
      integer :: j, first, last, n
      if (is_endless(set)) then
         traces = reshape([low, high], [2, 1])
         return
      end if
      cell = set%trace + set%bridge
      phase = set%start + modulo(set%stagger*number, 1.0_wp)*cell
      first = floor((low - phase)/cell) - 1
      if (.not. set%randomness > 0) then
         last = floor((high - phase)/cell) + 1
         allocate (traces(2, last - first + 1))
         do j = first, last
            traces(1, j - first + 1) = phase + j*cell
            traces(2, j - first + 1) = phase + j*cell + set%trace
         end do
         return
      end if
      call stream%uniform(u)
      if (set%trace_law == law%uniform) then
         at = phase + (first - 1)*cell + (2*u - 1)*set%randomness*cell
      else
         at = phase + (first - lead + u)*cell
      end if
      allocate (traces(2, 16))
      n = 0
      do while (at < high)
         call varied(stream, set%trace, set%trace_law, set%randomness, length)
         call varied(stream, set%bridge, set%trace_law, set%randomness, gap)
         if (at + length > low) then
            n = n + 1
            call grow(traces, n, 2)
            traces(:, n) = [at, at + length]
         end if
         at = at + length + gap
      end do
      traces = traces(:, 1:n)
   end subroutine line_traces

end module rockdda_lines_joint_sets
