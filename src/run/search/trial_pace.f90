! SPDX-License-Identifier: MIT
!> The pace of a trial: static steps, and steps that carry velocities on where static ones hardly move.
!>
!> Every static step begins at rest, so that a constant pull P moves a mass m by P dt**2/(2 m) in each step. Where
!> contacts open and close all the time, steps stay short, and a mechanism whose forces miss equilibrium by a thousandth
!> needs thousands of steps to move as far as its verdict needs. Steps that carry velocities on move it by n**2 times as
!> much in n steps. So velocities are carried on, for a while, when
!>
!>     the model is stuck     the unbalanced force no longer falls and blocks hardly move
!>     the model slides       all that contacts do is friction, and the unbalanced force falls far less than the way
!>                            grows
!>
!> and static steps follow, one of which shows whether a model that slides goes on alike. The verdict is reached in
!> static steps alone: it compares pulls of blocks that begin at rest.
module rockdda_run_trial_pace
   use rockdda_base_kinds, only : wp
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: trial_pace_type

   !> Static steps after which the least unbalanced force is compared with the least one before: while steps are shorter
   !> than dt_max, else; when velocities have been carried, so few that they show whether the pull has stayed.
   integer, parameter :: short_steps = 10, static_steps = 20, checking_steps = 10
   !> Velocities are carried when the unbalanced force is still more than the first share, and the largest distance from
   !> the settled state has grown by less than the second factor in these steps.
   real(wp), parameter :: no_progress = 0.5_wp, farther = 1.5_wp
   !> They are carried over so many steps, until the distance has grown by `farther`, as verdicts compare pulls at
   !> distances that lie as far apart, or until blocks swing back.
   integer, parameter :: carried_steps = 100
   !> A model slides when `sliding_steps` steps in a row have a larger share of friction than this in the work of the
   !> contacts, it has moved by more than this part of a first length, and the logarithm of the unbalanced force has
   !> fallen by less than this part of the rise of that of the distance. It slides on alike when the unbalanced force
   !> after the steps that carry is more than this share of that before.
   real(wp), parameter :: mostly = 0.9_wp, least_way = 0.25_wp, hardly_falls = 0.15_wp, alike = 0.98_wp
   integer, parameter :: sliding_steps = 3
   !> After a step that had to be cut no longer one than this part of it is tried for so many steps.
   real(wp), parameter :: shorter = 0.7_wp
   integer, parameter :: cautious_steps = 15
   !> Share of the velocity that is carried on. Below 1, so that blocks that ring about their place come to rest.
   real(wp), parameter :: carried = 0.95_wp

   type :: trial_pace_type
      logical :: carries = .false.                       !! the next step begins with the velocities of this one
      integer, private :: steps = 0                      !! since the pace has changed, or was checked
      integer, private :: enough = static_steps
      real(wp), private :: least = huge(1.0_wp)          !! unbalanced force of these steps
      real(wp), private :: least_before = huge(1.0_wp)
      real(wp), private :: start = 0                     !! distance when the pace changed, or was checked [length]
      integer, private :: slides = 0                     !! static steps in a row in which the model slides
      logical, private :: has_slid = .false.             !! velocities were carried because it did
      real(wp), private :: sliding_pull = 0              !! unbalanced force then
      real(wp), private :: last_distance = 0, last_unbalanced = 0   !! after the last static step
      integer, private :: since_cut = 0                  !! steps
      real(wp), private :: farthest = 0                  !! distance while velocities are carried [length]
      real(wp), private :: dt = 0                        !! longest step that carries velocities [time]
   contains
      procedure :: follow
      procedure, private :: set
      procedure, private :: watch_slide
      procedure, private :: watch_cuts
   end type trial_pace_type

contains

   !> Choose how the next step begins.
   subroutine follow(self, distance, way, sim)
      class(trial_pace_type), intent(inout) :: self
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      real(wp), intent(in) :: way                    !! largest of a block in first lengths
      type(simulation_type), intent(inout) :: sim    !! after an accepted step of the trial
      logical :: stuck
      integer :: most        ! static steps before they are judged
      self%steps = self%steps + 1
      call self%watch_cuts(sim)
      call self%watch_slide(distance, way, sim)
      if (self%carries) then
         ! as long as static steps: only these may grow beyond dt_max
         sim%control%dt = min(self%dt, sim%control%brisk%longest, sim%control%method%growth*sim%control%last_dt)
         if (self%steps < carried_steps .and. distance < farther*self%start .and. .not. distance < self%farthest .and. &
             sim%control%balanced == 0) then
            self%farthest = distance
            return
         end if
         call self%set(.false., distance, sim)
         self%enough = checking_steps
         return
      end if
      if (self%slides >= sliding_steps .or. (self%has_slid .and. self%steps == 1 .and. &
                                             sim%record%unbalanced > alike*self%sliding_pull)) then
         self%has_slid = .true.
         self%sliding_pull = sim%record%unbalanced
         call self%set(.true., distance, sim)
         return
      end if
      self%has_slid = .false.
      self%least = min(self%least, sim%record%unbalanced)
      most = merge(short_steps, static_steps, sim%control%last_dt < sim%parameters%dt_max)
      if (self%steps < min(self%enough, most)) return
      stuck = self%least > no_progress*self%least_before .and. &
              distance < self%start*farther**(real(self%steps, wp)/most)
      self%least_before = min(self%least, self%least_before)
      call self%set(stuck, distance, sim)
   end subroutine follow

   !> Does the model slide?
   subroutine watch_slide(self, distance, way, sim)
      class(trial_pace_type), intent(inout) :: self
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      real(wp), intent(in) :: way                    !! the same in first lengths
      type(simulation_type), intent(in) :: sim
      logical :: slides
      if (self%carries) return
      slides = sim%control%slip_share > mostly .and. way > least_way .and. &
               self%last_distance > 0 .and. distance > self%last_distance .and. sim%record%unbalanced > 0
      if (slides) slides = log(self%last_unbalanced/sim%record%unbalanced) < hardly_falls* &
                           log(distance/self%last_distance)
      self%slides = merge(self%slides + 1, 0, slides)
      self%last_distance = distance
      self%last_unbalanced = sim%record%unbalanced
   end subroutine watch_slide

   !> Try no step for a while that is as long as one that had to be cut.
   subroutine watch_cuts(self, sim)
      class(trial_pace_type), intent(inout) :: self
      type(simulation_type), intent(inout) :: sim
      associate (longest => sim%control%brisk%longest, record => sim%record)
         self%since_cut = self%since_cut + 1
         if (record%attempts > 1) then
            self%since_cut = 0
            longest = max(sim%parameters%dt_max, &
                          shorter*record%dt/sim%parameters%cut_factor**(record%attempts - 1))
         else if (self%since_cut > cautious_steps) then
            longest = huge(1.0_wp)
         end if
      end associate
   end subroutine watch_cuts

   !> Carry velocities from now on, or not.
   subroutine set(self, carries, distance, sim)
      class(trial_pace_type), intent(inout) :: self
      logical, intent(in) :: carries
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      type(simulation_type), intent(inout) :: sim
      self%steps = 0
      self%start = distance
      self%farthest = 0
      self%enough = static_steps
      self%least = huge(1.0_wp)
      if (carries .eqv. self%carries) return
      self%carries = carries
      if (carries) self%dt = max(sim%control%dt, sim%parameters%dt_max)
      sim%parameters%stages(size(sim%parameters%stages))%k01 = merge(carried, 0.0_wp, carries)
      sim%control%balanced = 0
      if (.not. carries) sim%state%velocity = 0
   end subroutine set

end module rockdda_run_trial_pace
