! SPDX-License-Identifier: MIT
!> Statistics of the lines drawn: numbers of lines and traces, means and deviations of spacing and lengths.
module rockdda_lines_report
   use rockdda_base_kinds, only : wp
   implicit none
   private
   public :: lines_report_type, set_report_type, sample_type, fill_report

   !> Statistics of one set.
   type :: set_report_type
      integer :: n_lines = 0            !! lines that cross the region
      integer :: n_traces = 0           !! pieces of joints in the rock
      integer :: n_whole = 0            !! traces that were not clipped
      integer :: n_drawn = 0            !! traces in the statistics below: those that begin in the region's extent
      integer :: n_bridges = 0          !! after these
      real(wp) :: spacing = 0           !! mean distance of neighbouring lines [L]; 0 without lines; the same below
      real(wp) :: spacing_deviation = 0 !! standard deviation
      real(wp) :: trace = 0, trace_deviation = 0, trace_least = 0, trace_most = 0 !! as drawn, before clipping
      real(wp) :: bridge = 0, bridge_deviation = 0
      real(wp) :: length = 0            !! of all pieces together
   end type set_report_type

   type :: lines_report_type
      type(set_report_type), allocatable :: sets(:)
      integer :: n_short = 0            !! pieces in the rock that were too short to keep
      real(wp) :: rock_area = 0         !! region less openings
   end type lines_report_type

   !> Sums of a sample.
   type :: sample_type
      integer :: n = 0
      real(wp) :: total = 0, squares = 0
      real(wp) :: least = huge(1.0_wp), most = 0
   contains
      procedure :: take
      procedure :: mean
      procedure :: deviation
   end type sample_type

contains

   !> Compute means and deviations.
   pure subroutine fill_report(report, spacing, trace, bridge)
      type(set_report_type), intent(inout) :: report
      type(sample_type), intent(in) :: spacing, trace, bridge
      report%n_drawn = trace%n
      report%n_bridges = bridge%n
      report%spacing = spacing%mean()
      report%spacing_deviation = spacing%deviation()
      report%trace = trace%mean()
      report%trace_deviation = trace%deviation()
      if (trace%n > 0) report%trace_least = trace%least
      report%trace_most = trace%most
      report%bridge = bridge%mean()
      report%bridge_deviation = bridge%deviation()
   end subroutine fill_report

   !> Add a value to a sample.
   pure subroutine take(self, value)
      class(sample_type), intent(inout) :: self
      real(wp), intent(in) :: value
      self%n = self%n + 1
      self%total = self%total + value
      self%squares = self%squares + value**2
      self%least = min(self%least, value)
      self%most = max(self%most, value)
   end subroutine take

   !> Mean of a sample, 0 without values.
   pure real(wp) function mean(self)
      class(sample_type), intent(in) :: self
      mean = self%total/max(1, self%n)
   end function mean

   !> Standard deviation of a sample; 0 for values that are equal up to rounding.
   pure real(wp) function deviation(self)
      class(sample_type), intent(in) :: self
      real(wp) :: m, variance
      deviation = 0
      if (self%n < 2) return
      m = self%mean()
      variance = (self%squares - self%n*m**2)/(self%n - 1)
      if (variance > 1.0e-14_wp*m**2*self%n) deviation = sqrt(variance)
   end function deviation

end module rockdda_lines_report
