! SPDX-License-Identifier: MIT
!> Which blocks a failing trial moves, and how.
!>
!>     falling    nothing holds the block: its pull is its weight, and it moves along it
!>     toppling   the block, and with it those that stay together with it, turns on what holds it: its joints to the
!>                blocks that move least open at one end by more than they slip
!>     sliding    else
!>
!> Motion is that since the settled state, as of rigid bodies. Along a straight joint the slip is the same everywhere;
!> the difference between the openings of its ends is the difference of the rotations times its length. So a voussoir
!> between hinges turns, although it may turn about a point far away, and a wedge between two planes slides.
module rockdda_run_mechanism
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_state
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_stepping_verdict, only : verdict_type
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
   !> Blocks in contact stay together when they slip on each other, and open at an end, by less than this share of what
   !> the faster one moves.
   real(wp), parameter :: together = 0.1_wp
   !> One kind of motion for the mechanism when at least this share of its blocks has it.
   real(wp), parameter :: most = 0.75_wp

   !> A joint: rows of the contact table between the same two edges.
   type :: joint_slip_type
      integer :: a = 0, b = 0        !! blocks
      real(wp) :: slip = 0           !! of a on b along the joint [length]
      real(wp) :: opening = 0        !! of one end more than of the other [length]
   end type joint_slip_type

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
      type(verdict_type), intent(in) :: trial
      type(mechanism_type), intent(out) :: mechanism
      type(joint_slip_type), allocatable :: joints(:)
      integer, allocatable :: group(:)      !! (nb) blocks that stay together have one number
      integer :: i
      logical, allocatable :: moves(:)      !! (nb)
      allocate (moves(size(trial%moved)), source=trial%moved >= least_share*maxval(trial%moved) .and. trial%moved > 0)
      mechanism%blocks = pack([(i, i=1, size(moves))], moves)
      allocate (mechanism%kinds(size(mechanism%blocks)))
      joints = closed_joints(sim, trial)
      group = groups(joints, moves, trial%moved)
      do i = 1, size(mechanism%blocks)
         associate (b => mechanism%blocks(i))
            mechanism%kinds(i) = motion%sliding
            if (falls(sim, trial, b)) then
               mechanism%kinds(i) = motion%fall
            else if (turns(joints, group, group(b), trial%moved)) then
               mechanism%kinds(i) = motion%toppling
            end if
         end associate
      end do
   end subroutine find_mechanism

   !> The joints that are closed, at a point at least, with the relative motion of their blocks.
   function closed_joints(sim, trial) result(joints)
      type(simulation_type), intent(in) :: sim
      type(verdict_type), intent(in) :: trial
      type(joint_slip_type), allocatable :: joints(:)
      integer :: c, d, n
      real(wp) :: along(2), at(2)
      allocate (joints(sim%contacts%n))
      n = 0
      c = 1
      associate (table => sim%contacts)
         do while (c <= table%n)
            d = c
            do while (d < table%n)
               if (table%block_a(d + 1) /= table%block_a(c) .or. table%block_b(d + 1) /= table%block_b(c) .or. &
                   table%vertex(d + 1) /= table%vertex(c) .or. table%edge(d + 1) /= table%edge(c)) exit
               d = d + 1
            end do
            if (any(table%state(c:d) /= contact_state%open)) then
               n = n + 1
               at = sim%state%vertices(:, table%edge(c))
               along = [-table%normal(2, c), table%normal(1, c)]
               joints(n)%a = table%block_a(c)
               joints(n)%b = table%block_b(c)
               joints(n)%slip = abs(dot_product(along, motion_at(joints(n)%a, at) - motion_at(joints(n)%b, at)))
               joints(n)%opening = sum(table%length(c:d))*abs(turned(joints(n)%a) - turned(joints(n)%b))
            end if
            c = d + 1
         end do
      end associate
      joints = joints(1:n)

   contains

      !> Displacement of a block, as of a rigid body, at a point.
      pure function motion_at(i, point) result(way)
         integer, intent(in) :: i
         real(wp), intent(in) :: point(2)
         real(wp) :: way(2), arm(2)
         arm = point - sim%state%centroid(:, i)
         way = sim%state%centroid(:, i) - trial%centroid(:, i) + turned(i)*[-arm(2), arm(1)]
      end function motion_at

      !> Its rotation since the settled state [rad].
      pure real(wp) function turned(i)
         integer, intent(in) :: i
         turned = sim%state%rotation(i) - trial%rotation(i)
      end function turned

   end function closed_joints

   !> Number the blocks that stay together alike.
   pure function groups(joints, moves, moved) result(group)
      type(joint_slip_type), intent(in) :: joints(:)
      logical, intent(in) :: moves(:)
      real(wp), intent(in) :: moved(:)
      integer :: group(size(moves))
      integer :: i, j, k
      logical :: has_changed
      group = [(i, i=1, size(moves))]
      has_changed = .true.
      do while (has_changed)
         has_changed = .false.
         do j = 1, size(joints)
            associate (a => joints(j)%a, b => joints(j)%b)
               if (group(a) == group(b) .or. .not. (moves(a) .and. moves(b))) cycle
               if (max(joints(j)%slip, joints(j)%opening) > together*max(moved(a), moved(b))) cycle
               k = min(group(a), group(b))
               group([a, b]) = k
               has_changed = .true.
            end associate
         end do
      end do
   end function groups

   !> Does a group turn on what holds it? These are the joints to its least moving neighbours.
   pure logical function turns(joints, group, g, moved)
      type(joint_slip_type), intent(in) :: joints(:)
      integer, intent(in) :: group(:)     !! (nb)
      integer, intent(in) :: g            !! number of the group
      real(wp), intent(in) :: moved(:)    !! (nb)
      real(wp) :: least, slip, opening
      integer :: j, other
      least = huge(1.0_wp)
      do j = 1, size(joints)
         other = neighbour(joints(j))
         if (other > 0) least = min(least, moved(other))
      end do
      slip = 0
      opening = 0
      do j = 1, size(joints)
         other = neighbour(joints(j))
         if (other == 0) cycle
         if (moved(other) > least + least_share*maxval(moved)) cycle
         slip = slip + joints(j)%slip
         opening = opening + joints(j)%opening
      end do
      turns = opening > slip

   contains

      !> The block on the other side of a joint of the group; 0: it is none of its joints.
      pure integer function neighbour(joint)
         type(joint_slip_type), intent(in) :: joint
         neighbour = 0
         if (group(joint%a) == group(joint%b)) return
         if (group(joint%a) == g) neighbour = joint%b
         if (group(joint%b) == g) neighbour = joint%a
      end function neighbour

   end function turns

   !> Does nothing hold a block?
   pure logical function falls(sim, trial, b)
      type(simulation_type), intent(in) :: sim
      type(verdict_type), intent(in) :: trial
      integer, intent(in) :: b
      real(wp) :: way(2), weight(2)
      way = sim%state%centroid(:, b) - trial%centroid(:, b)
      weight = sim%families%loads%weight(1:2, b)
      falls = sim%forces%force_of(b, sim%state) >= held_by_nothing*norm2(weight) .and. &
              dot_product(way, weight) >= held_by_nothing*norm2(way)*norm2(weight)
   end function falls

end module rockdda_run_mechanism
