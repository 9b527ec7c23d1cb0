! SPDX-License-Identifier: MIT
!> Which blocks a failing trial moves, and how.
!>
!>     falling    nothing holds the block: its pull is its weight, and it moves along it
!>     toppling   the block, and with it those that stay together with it, turns about a point near them
!>     sliding    else
module rockdda_run_mechanism
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_state
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
   !> The centre of what turns lies within so many of its diagonals.
   real(wp), parameter :: near = 2
   !> Blocks in contact stay together when their rotations differ by less than this share of the larger one.
   real(wp), parameter :: together = 0.2_wp
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
      real(wp), allocatable :: turned(:)    !! (nb) rotation since the settled state [rad]
      real(wp), allocatable :: extent(:)    !! (nb) diagonal of what stays together [length]
      integer :: i
      logical, allocatable :: moves(:)      !! (nb)
      allocate (moves(size(trial%moved)), source=trial%moved >= least_share*maxval(trial%moved) .and. trial%moved > 0)
      mechanism%blocks = pack([(i, i=1, size(moves))], moves)
      allocate (mechanism%kinds(size(mechanism%blocks)), turned(size(moves)))
      turned = sim%state%rotation - trial%rotation
      extent = extents(sim, moves, turned)
      do i = 1, size(mechanism%blocks)
         associate (b => mechanism%blocks(i))
            mechanism%kinds(i) = motion_of(sim, trial, b, turned(b), extent(b))
         end associate
      end do
   end subroutine find_mechanism

   !> Diagonals of the groups of blocks that turn together, for each block that moves.
   function extents(sim, moves, turned) result(extent)
      type(simulation_type), intent(in) :: sim
      logical, intent(in) :: moves(:)
      real(wp), intent(in) :: turned(:)
      real(wp) :: extent(size(moves))
      integer :: group(size(moves))
      real(wp) :: box(4, size(moves))       !! of the group that has this number
      integer :: a, b, c, i, first, last
      logical :: has_changed
      group = [(i, i=1, size(moves))]
      has_changed = .true.
      do while (has_changed)
         has_changed = .false.
         do c = 1, sim%contacts%n
            a = sim%contacts%block_a(c)
            b = sim%contacts%block_b(c)
            if (sim%contacts%state(c) == contact_state%open .or. group(a) == group(b)) cycle
            if (.not. (moves(a) .and. moves(b))) cycle
            if (abs(turned(a) - turned(b)) > together*max(abs(turned(a)), abs(turned(b)))) cycle
            group([a, b]) = min(group(a), group(b))
            has_changed = .true.
         end do
      end do
      box(1:2, :) = huge(1.0_wp)
      box(3:4, :) = -huge(1.0_wp)
      do i = 1, size(moves)
         first = sim%blocks%vertex_offset(i) + 1
         last = sim%blocks%vertex_offset(i + 1)
         associate (of_group => box(:, group(i)), points => sim%state%vertices(:, first:last))
            of_group(1:2) = min(of_group(1:2), minval(points, dim=2))
            of_group(3:4) = max(of_group(3:4), maxval(points, dim=2))
         end associate
      end do
      do i = 1, size(moves)
         extent(i) = norm2(box(3:4, group(i)) - box(1:2, group(i)))
      end do
   end function extents

   !> How one block moves.
   pure integer function motion_of(sim, trial, b, turned, extent)
      type(simulation_type), intent(in) :: sim
      type(trial_verdict_type), intent(in) :: trial
      integer, intent(in) :: b
      real(wp), intent(in) :: turned      !! rotation since the settled state [rad]
      real(wp), intent(in) :: extent      !! of the blocks that turn with it [length]
      real(wp) :: way(2), weight(2)
      way = sim%state%centroid(:, b) - trial%centroid(:, b)
      weight = sim%families%loads%weight(1:2, b)
      motion_of = motion%sliding
      if (sim%forces%force_of(b, sim%state) >= held_by_nothing*norm2(weight) .and. &
          dot_product(way, weight) >= held_by_nothing*norm2(way)*norm2(weight)) then
         motion_of = motion%fall
      else if (abs(turned)*near*extent >= norm2(way)) then
         motion_of = motion%toppling
      end if
   end function motion_of

end module rockdda_run_mechanism
