! SPDX-License-Identifier: MIT
!> Which blocks a failing trial moves, and how.
!>
!>     falling    nothing holds the block: its pull is its weight, and it moves along it
!>     toppling   the block turns about a point near it, or with the others about a point within the mechanism
!>     sliding    else
module rockdda_run_mechanism
   use rockdda_base_kinds, only : wp
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_run_trial_verdict, only : trial_verdict_type
   implicit none
   private
   public :: mechanism_type, motion, find_mechanism, kind_of

   type :: motion_enum
      integer :: sliding = 0
      integer :: toppling = 1
      integer :: fall = 2
   end type motion_enum
   type(motion_enum), parameter :: motion = motion_enum()
   character(len=*), parameter :: motion_names(0:2) = [character(len=8) :: 'sliding', 'toppling', 'fall']

   !> Blocks that move less than this share of what the fastest one moves are none of the mechanism.
   real(wp), parameter :: least_share = 0.05_wp
   !> A pull of at least this share of the weight: nothing holds the block.
   real(wp), parameter :: held_by_nothing = 0.9_wp
   !> The centre of a turning block lies within so many of its radii of inertia (a square that turns about its corner:
   !> 1.7, a slender block: 1.7).
   real(wp), parameter :: near = 5
   !> Blocks turn together when their rotations differ from the mean one by less than this share of it.
   real(wp), parameter :: together = 0.5_wp
   !> One kind of motion for the mechanism when at least this share of its blocks has it.
   real(wp), parameter :: most = 0.75_wp

   type :: mechanism_type
      integer, allocatable :: blocks(:)   !! from 1, ascending
      integer, allocatable :: kinds(:)    !! one of motion%... each
   end type mechanism_type

contains

   !> 'sliding', 'toppling', 'fall', or 'mixed'.
   pure function kind_of(mechanism) result(name)
      type(mechanism_type), intent(in) :: mechanism
      character(len=:), allocatable :: name
      integer :: k
      name = 'mixed'
      do k = 0, 2
         if (count(mechanism%kinds == k) >= most*size(mechanism%kinds)) name = trim(motion_names(k))
      end do
   end function kind_of

   !> The mechanism in the state at the end of a failing trial.
   subroutine find_mechanism(sim, trial, mechanism)
      type(simulation_type), intent(in) :: sim
      type(trial_verdict_type), intent(in) :: trial
      type(mechanism_type), intent(out) :: mechanism
      real(wp) :: corners(2, 2), extent, mean
      real(wp), allocatable :: turned(:)
      integer :: b, i, first, last
      mechanism%blocks = pack([(i, i=1, size(trial%moved))], trial%moved >= least_share*maxval(trial%moved) .and. &
                              trial%moved > 0)
      allocate (mechanism%kinds(size(mechanism%blocks)), turned(size(mechanism%blocks)))
      if (size(mechanism%blocks) == 0) return
      corners(:, 1) = huge(1.0_wp)
      corners(:, 2) = -huge(1.0_wp)
      do i = 1, size(mechanism%blocks)
         b = mechanism%blocks(i)
         first = sim%blocks%vertex_offset(b) + 1
         last = sim%blocks%vertex_offset(b + 1)
         corners(:, 1) = min(corners(:, 1), minval(sim%state%vertices(:, first:last), dim=2))
         corners(:, 2) = max(corners(:, 2), maxval(sim%state%vertices(:, first:last), dim=2))
         turned(i) = sim%state%rotation(b) - trial%rotation(b)
      end do
      extent = norm2(corners(:, 2) - corners(:, 1))
      mean = sum(turned)/size(turned)
      do i = 1, size(mechanism%blocks)
         mechanism%kinds(i) = motion_of(sim, trial, mechanism%blocks(i), turned(i), mean, extent)
      end do
   end subroutine find_mechanism

   !> How one block moves.
   pure integer function motion_of(sim, trial, b, turned, mean, extent)
      type(simulation_type), intent(in) :: sim
      type(trial_verdict_type), intent(in) :: trial
      integer, intent(in) :: b
      real(wp), intent(in) :: turned      !! rotation since the settled state [rad]
      real(wp), intent(in) :: mean        !! of all blocks of the mechanism
      real(wp), intent(in) :: extent      !! of the mechanism [length]
      real(wp) :: way(2), weight(2), radius
      way = sim%state%centroid(:, b) - trial%centroid(:, b)
      weight = sim%families%loads%weight(1:2, b)
      radius = sqrt((sim%state%moments(1, b) + sim%state%moments(2, b))/sim%state%area(b))
      motion_of = motion%sliding
      if (sim%forces%force_of(b, sim%state) >= held_by_nothing*norm2(weight) .and. &
          dot_product(way, weight) >= held_by_nothing*norm2(way)*norm2(weight)) then
         motion_of = motion%fall
      else if (abs(turned)*near*radius >= norm2(way)) then
         motion_of = motion%toppling
      else if (abs(turned - mean) <= together*abs(mean) .and. abs(turned)*extent >= norm2(way)) then
         motion_of = motion%toppling
      end if
   end function motion_of

end module rockdda_run_mechanism
