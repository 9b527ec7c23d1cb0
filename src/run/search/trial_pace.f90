! SPDX-License-Identifier: MIT
!> The pace of a trial: static steps, and steps that carry velocities on where static ones hardly move.
!>
!> Every static step begins at rest, so that a constant pull P moves a mass m by P dt**2/(2 m) in each step. Where
!> contacts open and close all the time, steps stay short, and a mechanism whose forces miss equilibrium by a thousandth
!> needs thousands of steps to move as far as its verdict needs. Steps that carry velocities on move it by n**2 times as
!> much in n steps. So, when the unbalanced force no longer falls and blocks hardly move, `carried_steps` steps carry
!> velocities on, and static ones follow. The verdict is reached in static steps alone: it compares pulls of blocks that
!> begin at rest.
module rockdda_run_trial_pace
   use rockdda_base_kinds, only : wp
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: trial_pace_type

   !> Static steps after which the least unbalanced force is compared with the least one before: while steps are shorter
   !> than dt_max, else; when velocities have been carried, so few that they show whether the pull has stayed.
   integer, parameter :: short_steps = 10, static_steps = 50, checking_steps = 5
   !> Velocities are carried when the unbalanced force is still more than the first share, and the largest distance from
   !> the settled state has grown by less than the second factor in these steps.
   real(wp), parameter :: no_progress = 0.5_wp, farther = 1.5_wp
   !> They are carried over so many steps, or until the distance has grown by `farther`: verdicts compare pulls while it
   !> grows fourfold.
   integer, parameter :: carried_steps = 25
   !> Share of the velocity that is carried on. Below 1, so that blocks that ring about their place come to rest.
   real(wp), parameter :: carried = 0.99_wp

   type :: trial_pace_type
      logical :: carries = .false.                       !! the next step begins with the velocities of this one
      integer, private :: steps = 0                      !! since the pace has changed, or was checked
      integer, private :: enough = static_steps
      real(wp), private :: least = huge(1.0_wp)          !! unbalanced force of these steps
      real(wp), private :: least_before = huge(1.0_wp)
      real(wp), private :: start = 0                     !! distance when the pace changed, or was checked [length]
      real(wp), private :: dt = 0                        !! longest step that carries velocities [time]
   contains
      procedure :: follow
      procedure, private :: set
   end type trial_pace_type

contains

   !> Choose how the next step begins.
   subroutine follow(self, distance, sim)
      class(trial_pace_type), intent(inout) :: self
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      type(simulation_type), intent(inout) :: sim    !! after an accepted step of the trial
      logical :: stuck
      integer :: most        ! static steps before they are judged
      self%steps = self%steps + 1
      if (self%carries) then
         ! as long as static steps: only these may grow beyond dt_max
         sim%control%dt = min(self%dt, sim%control%method%growth*sim%control%last_dt)
         if (self%steps < carried_steps .and. distance < farther*self%start .and. sim%control%balanced == 0) return
         call self%set(.false., distance, sim)
         self%enough = checking_steps
         return
      end if
      self%least = min(self%least, sim%record%unbalanced)
      most = merge(short_steps, static_steps, sim%control%last_dt < sim%parameters%dt_max)
      if (self%steps < min(self%enough, most)) return
      stuck = self%least > no_progress*self%least_before .and. &
              distance < self%start*farther**(real(self%steps, wp)/most)
      self%least_before = min(self%least, self%least_before)
      call self%set(stuck, distance, sim)
   end subroutine follow

   !> Carry velocities from now on, or not.
   subroutine set(self, carries, distance, sim)
      class(trial_pace_type), intent(inout) :: self
      logical, intent(in) :: carries
      real(wp), intent(in) :: distance               !! largest of a block from the settled state [length]
      type(simulation_type), intent(inout) :: sim
      self%steps = 0
      self%start = distance
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
