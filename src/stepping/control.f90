! SPDX-License-Identifier: MIT
!> Step sizes and stages.
!>
!> dt starts at dt_max. A step that does not converge, or moves a vertex further than displacement_ratio*w0, is
!> begun again with a smaller dt, not below dt_min; after an accepted step dt grows back by at most `growth`
!> towards dt_max, and not beyond what the last step's displacement allows. Ends of stages and of the run
!> shorten one step to land on them without changing the dt that follows.
module rockdda_stepping_control
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : stage_type, is_set
   use rockdda_model_parameters, only : parameters_type
   implicit none
   private
   public :: step_control_type, new_step_control, check_stages, cut_for_displacement, growth
   public :: cut_reason, n_cut_reasons, cut_names

   !> Why an attempt at a step is repeated with a shorter step.
   type :: cut_reason_enum
      integer :: displacement = 1   !! a vertex would move further than g2 w0
      integer :: contacts = 2       !! contacts still change after the last open-close round
      integer :: solver = 3         !! the equations could not be solved
      integer :: ruined_block = 4   !! a block would invert or vanish
   end type cut_reason_enum
   type(cut_reason_enum), parameter :: cut_reason = cut_reason_enum()
   integer, parameter :: n_cut_reasons = 4
   !> Names for programs.
   character(len=*), parameter :: cut_names(n_cut_reasons) = [character(len=16) :: 'displacement', 'contacts', &
                                                             'solver', 'ruined_block']

   !> Largest factor by which the step grows after an accepted step.
   real(wp), parameter :: growth = 1.5_wp

   !> Part of the state of a run.
   type :: step_control_type
      real(wp) :: dt = 0                    !! next step to try [time]
      real(wp) :: last_dt = 0               !! of the last accepted step
      real(wp) :: last_displacement = 0     !! largest vertex displacement of the last accepted step [length]
      real(wp) :: last_k01 = 1              !! with which its velocity was carried on
      integer :: stage = 1                  !! present stage; beyond the list: no stage
      logical, allocatable :: released(:)   !! (nf) fixed points let go so far
      integer :: cuts(n_cut_reasons) = 0    !! steps cut so far, by reason
      integer :: short_steps = 0            !! accepted steps after which dt could not grow back because of g2 w0
   contains
      procedure :: k01
      procedure :: gravity
      procedure :: step_size
      procedure :: accepted
      procedure :: end_stages
   end type step_control_type

contains

   !> Control at the start of a run.
   pure subroutine new_step_control(parameters, n_fixed, control)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_fixed
      type(step_control_type), intent(out) :: control
      control%dt = parameters%dt_max
      allocate (control%released(n_fixed), source=.false.)
   end subroutine new_step_control

   !> k01 of the present stage.
   pure real(wp) function k01(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      k01 = parameters%k01
      if (self%stage > size(parameters%stages)) return
      if (is_set(parameters%stages(self%stage)%k01)) k01 = parameters%stages(self%stage)%k01
   end function k01

   !> Factor on the weights in the present stage.
   pure real(wp) function gravity(self, parameters)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      gravity = 1
      if (self%stage <= size(parameters%stages)) gravity = parameters%stages(self%stage)%gravity
   end function gravity

   !> The step to try from `time`: dt, or what is left to the next end of a stage or of the run.
   pure real(wp) function step_size(self, parameters, time) result(dt)
      class(step_control_type), intent(in) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: time
      real(wp) :: target
      dt = self%dt
      target = parameters%t_end
      if (self%stage <= size(parameters%stages)) then
         if (is_set(parameters%stages(self%stage)%until_time)) &
            target = min(target, parameters%stages(self%stage)%until_time)
      end if
      ! a remainder below 1e-6 dt is taken along, so that round-off in the time makes no extra step
      if (time + dt*(1 + 1.0e-6_wp) >= target .and. target > time) dt = target - time
   end function step_size

   !> Next dt after an accepted step.
   pure subroutine accepted(self, parameters, dt, displacement, shortened, k01_used)
      class(step_control_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt             !! step [time]
      real(wp), intent(in) :: displacement   !! largest of any vertex [length]
      logical, intent(in) :: shortened     !! dt was shortened to land on an end: keep the dt that was wanted
      real(wp), intent(in) :: k01_used
      real(wp) :: limit, wanted
      self%last_dt = dt
      self%last_displacement = displacement
      self%last_k01 = k01_used
      limit = parameters%displacement_ratio*parameters%w0
      if (shortened) return
      wanted = min(parameters%dt_max, growth*dt)
      if (displacement*wanted > 0.9_wp*limit*dt .and. wanted > dt) then
         wanted = max(dt, min(wanted, 0.9_wp*limit*dt/displacement))
         self%short_steps = self%short_steps + 1
      end if
      self%dt = max(parameters%dt_min, wanted)
   end subroutine accepted

   !> Smaller step after one that moved too far.
   pure real(wp) function cut_for_displacement(parameters, dt, displacement) result(smaller)
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt             !! step [time]
      real(wp), intent(in) :: displacement   !! largest of any vertex [length]
      real(wp) :: limit
      limit = parameters%displacement_ratio*parameters%w0
      smaller = max(parameters%dt_min, dt*max(parameters%cut_factor, min(0.9_wp, 0.8_wp*limit/displacement)))
   end function cut_for_displacement

   !> Leave the stages that have ended; their fixed points to release are marked.
   pure subroutine end_stages(self, parameters, step, time)
      class(step_control_type), intent(inout) :: self
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: step      !! accepted steps so far
      real(wp), intent(in) :: time
      integer :: i
      do while (self%stage <= size(parameters%stages))
         associate (stage => parameters%stages(self%stage))
            if (.not. has_ended(stage)) return
            if (allocated(stage%release)) then
               do i = 1, size(stage%release)
                  if (stage%release(i) >= 1 .and. stage%release(i) <= size(self%released)) &
                     self%released(stage%release(i)) = .true.
               end do
            end if
         end associate
         self%stage = self%stage + 1
      end do

   contains

      !> Is the stage over?
      pure logical function has_ended(stage)
         type(stage_type), intent(in) :: stage
         has_ended = .false.
         if (is_set(stage%until_step)) has_ended = step >= stage%until_step
         if (is_set(stage%until_time)) has_ended = has_ended .or. &
                                                   time >= stage%until_time*(1 - 1.0e-12_wp)
      end function has_ended

   end subroutine end_stages

   !> Stages may release only fixed points that exist.
   subroutine check_stages(parameters, n_fixed, messages)
      type(parameters_type), intent(in) :: parameters
      integer, intent(in) :: n_fixed
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, p
      do i = 1, size(parameters%stages)
         if (.not. allocated(parameters%stages(i)%release)) cycle
         do p = 1, size(parameters%stages(i)%release)
            if (parameters%stages(i)%release(p) < 1 .or. parameters%stages(i)%release(p) > n_fixed) then
               call messages%add(severity%error, 'stage '//to_string(i)//' releases fixed point '// &
                                 to_string(parameters%stages(i)%release(p))//', but the model has '// &
                                 to_string(n_fixed), parameters%stages(i)%origin)
            end if
         end do
      end do
   end subroutine check_stages

end module rockdda_stepping_control
