! SPDX-License-Identifier: MIT
!> The response of one contact of a joint: forces and new state from its motion and its memory.
!>
!> Signs: gap > 0 open; normal force > 0 compression; slip > 0 when the vertex moves along the edge (counter-clockwise
!> on block b); the shear spring's elongation has the sign of slip, the shear force acts against it.
!>
!> States of a contact and what acts in each:
!>     open      nothing
!>     locked    normal spring k_n at the gap, shear spring k_s at the elongation carried from the step's start
!>     sliding   normal spring, and friction against the slip: a given force in the equations, from the normal force
!>               that the last solve found
!>
!> The return mapping of plasticity: the shear spring is stretched by the slip of the step from where it was; what
!> exceeds the strength is cut off, and the contact slides.
!>
!>     shear force
!>         ^          ________________  strength (peak: with cohesion, while bonded)
!>         |         /:
!>         |        / :                 locked: on the line of slope k_s (and the dashpot)
!>         |  k_s  /  :                 sliding: on the horizontal line
!>         |      /   :
!>         +-----/----:--------------->  shear + slip
!>
!> The elongation is kept while a contact slides, at the strength over k_s, so that a contact which locks again starts
!> from the force it had. A sliding contact stays sliding as long as the stretched spring would reach the strength;
!> that also holds when the strength falls faster than the spring relaxes, where the sign of the slip alone would lock
!> and release the contact for ever.
!>
!> Dilation: a joint that slips opens by tan(psi) times the slip. The gap at which the joint carries no stress changes
!> between steps alone (rockdda_interaction_joint_strength, dilated_gap), so that the stiffness stays symmetric.
!>
!> All comparisons have a margin of round-off size: blocks that move together without a force between them would
!> otherwise change states for ever.
module rockdda_interaction_joint_response
   use rockdda_base_kinds, only : wp, i1, l1
   use rockdda_model_parameters, only : parameters_type
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   use rockdda_interaction_joint_strength, only : joint_law_type, strength_law, shear_strength, tension_at, &
      is_friction_alone
   use rockdda_interaction_time_scheme, only : time_scheme_type
   implicit none
   private
   public :: joint_settings_type, new_joint_settings, joint_state_type, joint_extra_type, joint_type, recall_joint, &
      joint_response_type, map_joint, map_steady, keep_steady, miss_of_joint, opening_gap, sliding_friction, &
      strength, spring_force, spring_energy, joint_end_type, end_joint, linearise_joint, linearise_joints

   !> A closed contact at the end of an accepted step.
   type :: joint_end_type
      real(wp) :: shear                !! elongation of the shear spring [length]
      real(wp) :: normal_force         !! of the spring, compression positive
      real(wp) :: shear_force          !! on block a along the edge
      real(wp) :: slipped              !! slip to sum up [length], >= 0
      real(wp) :: energy               !! in both springs
      real(wp) :: carried              !! elongation for the next step, mean of an interval [length]
      real(wp) :: lost                 !! energy beyond that of this elongation
      real(wp) :: core(2)              !! as that of the table
      real(wp) :: closed               !! share of the length by which it resists slip in the next step
   end type joint_end_type

   !> Lengths below this share of w0 are round-off.
   real(wp), parameter, public :: round_off = 1.0e-12_wp
   !> A joint slides beyond its strength by at most the first share of it. A strength below the second share of the
   !> stiffness times what is round-off is none: the joint slides beyond that.
   real(wp), parameter :: hardly = 1.0e-4_wp, nothing = 1.0e-2_wp

   !> Margins, the same for all contacts in an attempt at a step.
   type :: joint_settings_type
      real(wp) :: close_tolerance = 0  !! an open contact closes beyond this penetration [length]
      real(wp) :: open_tolerance = 0   !! a closed contact opens beyond this gap [length]
      real(wp) :: round_off = 0        !! changes of length below this are round-off [length]
      logical :: windows_rules = .false.   !! of DDA for Windows: slide-lock changes do not count; locked up to a 2.5
                                       !! times smaller shear
      logical :: sticks = .false.      !! closed contacts do not slide yet
      real(wp) :: dt = 1               !! step, for slip rates
      real(wp) :: level = 1            !! share of the step after which forces of closed contacts act
      real(wp) :: impact = 1           !! factor, in the equations, of forces of contacts that close
   end type joint_settings_type

   !> What an attempt at a step changes of a contact. Of large models there are many: the rest is in the contact table.
   type :: joint_state_type
      real(wp) :: friction             !! friction force of the solve while sliding, >= 0
      integer(i1) :: state             !! contact_state%...
      integer(i1) :: slip_sign         !! direction of the slip while sliding, +1/-1
      logical(l1) :: bonded            !! has peak cohesion and tensile strength, not those without a bond
      logical(l1) :: tied = .false.    !! intact rock: neither slides nor opens within a step
      logical(l1) :: worn = .false.    !! has opened and closed again and again: friction alone in this attempt
      logical(l1) :: strikes = .false. !! stays open in this attempt, for the law of impact (stepping)
      logical(l1) :: partly = .false.  !! one of an interval that is closed on a part, with `own` and `cross`
   end type joint_state_type

   !> What contacts have in an attempt only where the model has dashpots or dilation.
   type :: joint_extra_type
      real(wp) :: normal_drag = 0      !! normal dashpot coefficient over dt [force/length]
      real(wp) :: drag = 0             !! shear dashpot coefficient over dt [force/length]
      real(wp) :: drag_gap = 0         !! gap from which the step stretches the normal dashpot [length]
      real(wp) :: opens = 0            !! gap that dilation is expected to open in the step [length]
      real(wp) :: late = 0             !! what dilation changes `gap` by where the forces act [length]
   end type joint_extra_type

   !> One contact: its memory from the last step, its dashpots, and the state that the last solve gave it.
   type, extends(joint_state_type) :: joint_type
      real(wp) :: gap                  !! at the start of the step [length]
      real(wp) :: shear                !! elongation of the shear spring at the start of the step [length]
      real(wp) :: total_slip           !! |slip| summed up since the contact closed [length]
      real(wp) :: length               !! contact length for cohesion and tension
      real(wp) :: broken = 0           !! part of it that has lost its bond, while another part has not [length]
      real(wp) :: k_n, k_s             !! stiffness of its springs, normal and shear [force/length]
      real(wp) :: normal_drag          !! normal dashpot coefficient over dt [force/length]
      real(wp) :: drag                 !! shear dashpot coefficient over dt [force/length]
      real(wp) :: drag_gap = 0         !! gap from which the step stretches the normal dashpot [length]
      real(wp) :: late = 0             !! what dilation changes `gap` by where the forces act [length]
      logical :: closes = .false.      !! open at the start of the step: gap and slip are those of its end
   end type joint_type

   !> Forces of a closed contact at a motion, and the state that its law gives it there.
   type :: joint_response_type
      integer :: state
      integer :: slip_sign
      logical :: bonded
      real(wp) :: spring               !! force of the normal spring, compression positive
      real(wp) :: normal               !! the same with the dashpot
      real(wp) :: shear                !! against the slip
      real(wp) :: friction             !! strength without bond, while sliding
   end type joint_response_type

contains

   !> Margins of an attempt at a step of length dt.
   pure type(joint_settings_type) function new_joint_settings(parameters, dt, scheme) result(settings)
      type(parameters_type), intent(in) :: parameters
      real(wp), intent(in) :: dt               !! [time]
      type(time_scheme_type), intent(in) :: scheme
      settings%close_tolerance = parameters%close_tolerance
      settings%open_tolerance = parameters%open_tolerance
      settings%round_off = round_off*parameters%w0
      settings%windows_rules = parameters%windows_contacts
      settings%dt = dt
      settings%level = scheme%level
      settings%impact = scheme%impact
   end function new_joint_settings

   !> One contact, of the table at the start of the step and of the attempt.
   pure subroutine recall_joint(table, c, state, extra, joint)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                     !! row
      type(joint_state_type), intent(in) :: state
      type(joint_extra_type), allocatable, intent(in) :: extra(:)   !! (>= rows), or none
      type(joint_type), intent(inout) :: joint
      joint%joint_state_type = state
      joint%gap = table%gap(c)
      joint%shear = table%shear(c)
      ! an attempt that has worn a contact has freed its shear spring
      if (state%worn) joint%shear = 0
      joint%total_slip = table%total_slip(c)
      joint%length = table%length(c)
      joint%broken = 0
      if (state%bonded) joint%broken = broken_length(table, c)
      joint%k_n = table%k_n(c)
      joint%k_s = table%k_s(c)
      joint%closes = table%state(c) == contact_state%open
      if (allocated(extra)) then
         joint%normal_drag = extra(c)%normal_drag
         joint%drag = extra(c)%drag
         joint%drag_gap = extra(c)%drag_gap
         joint%late = extra(c)%late
      else
         joint%normal_drag = 0
         joint%drag = 0
         joint%drag_gap = 0
         joint%late = 0
      end if
   end subroutine recall_joint

   !> Length of a bonded row on which the bond of its interval is broken.
   pure real(wp) function broken_length(table, c) result(broken)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                     !! row
      integer :: r
      broken = 0
      if (.not. is_of_interval(table, c) .or. table%tied(c)) return
      r = min(c, other_row(table, c))
      broken = table%length(c)*(1 - max(0.0_wp, table%bond_end(r + 1) - table%bond_end(r)))
   end function broken_length

   !> Return mapping: the response of a contact that is closed at this motion. An open contact closes with the memory
   !> that it has.
   pure subroutine map_joint(law, settings, joint, gap, slip, response, normal_force)
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      type(joint_type), intent(in) :: joint
      real(wp), intent(in) :: gap, slip        !! at the end of the step, of the step [length]
      type(joint_response_type), intent(out) :: response
      !> Normal force that gives the friction, compression positive [force]: of a row of an interval half of that of
      !> the interval; absent: the force of its own spring.
      real(wp), intent(in), optional :: normal_force
      real(wp) :: trial, limit, slip_tolerance, pressing
      logical :: has_slid   ! in the last solve
      response%spring = spring_force(joint%k_n, gap)
      response%normal = response%spring - joint%normal_drag*(gap - joint%drag_gap)
      pressing = response%spring
      if (present(normal_force)) pressing = normal_force
      if (joint%tied) then
         limit = huge(limit)
      else
         limit = strength(law, settings, joint, pressing, logical(joint%bonded), slip)
      end if
      slip_tolerance = slip_margin(settings, joint%k_s, limit)
      trial = elastic_shear(joint, slip)
      has_slid = joint%state == contact_state%sliding
      if (limit <= 0 .and. law%friction <= 0 .and. law%final_friction <= 0) then
         ! a joint that can never carry any shear always slides
         response%slip_sign = direction(trial)
         if (has_slid) response%slip_sign = joint%slip_sign
         response%shear = 0
      else if (has_slid .and. .not. trial*joint%slip_sign < limit - slip_tolerance) then
         ! it slides on
         response%slip_sign = joint%slip_sign
         response%shear = joint%slip_sign*limit
      else if (abs(trial) > limit + slip_tolerance .and. .not. settings%sticks) then
         ! it begins to slide, or slides the other way
         response%slip_sign = direction(trial)
         response%shear = sign(limit, trial)
      else
         response%state = contact_state%locked
         response%slip_sign = 0
         response%shear = trial
         response%bonded = joint%bonded
         response%friction = 0
         return
      end if
      response%state = contact_state%sliding
      ! what has no length has no bond that could break
      response%bonded = joint%bonded .and. .not. (law%brittle .and. joint%length > 0)
      response%friction = limit
      if (joint%bonded .and. law%brittle) &
         response%friction = sliding_friction(law, settings, joint, pressing, slip)
   end subroutine map_joint

   !> The kernel beside `map_joint`: which rows of the table are steady, as most are mostly, and their forces along the
   !> lines of their links, bit by bit those of `map_joint`. Steady are closed rows that stay locked, or slide on
   !> without a bond, if their law is Coulomb's, linear along the normal, and they have no partner; rows of an interval
   !> only if it is closed on all its length. The forces of others are not used.
   pure subroutine map_steady(laws, table, first, settings, state, extra, widest, mean, gap, slip, steady, force)
      type(joint_law_type), intent(in) :: laws(:)              !! per joint material
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: first                               !! row that the n contacts begin with
      type(joint_settings_type), intent(in) :: settings
      type(joint_state_type), intent(in), contiguous :: state(:) !! (>= rows)
      type(joint_extra_type), allocatable, intent(in) :: extra(:)
      real(wp), intent(in), contiguous :: widest(:), mean(:)     !! (n) gaps that decide, `find_extremes` [length]
      real(wp), intent(in), contiguous :: gap(:), slip(:)        !! (n) at the end of the step, of the step [length]
      logical(l1), intent(out), contiguous :: steady(:)          !! (n)
      real(wp), intent(inout), contiguous :: force(:, :)         !! (2, n)
      real(wp) :: limit, margin, pressing, trial, drag
      integer :: c, k
      logical :: has_extra, friction_alone
      has_extra = allocated(extra)
      friction_alone = all(may_be_steady(laws) .and. is_friction_alone(laws))
      drag = 0
      do k = 1, size(steady)
         c = first - 1 + k
         associate (law => laws(table%joint(c)), k_s => table%k_s(c))
            trial = table%shear(c)
            if (state(c)%worn) trial = 0
            if (has_extra) drag = extra(c)%drag
            trial = k_s*(trial + slip(k)) + drag*slip(k)
            force(1, k) = table%k_n(c)*gap(k)
            if (has_extra) force(1, k) = force(1, k) + extra(c)%normal_drag*(gap(k) - extra(c)%drag_gap)
            pressing = -table%k_n(c)*mean(k)
            ! `shear_strength` of Coulomb's law, without a call
            limit = law%friction*max(pressing, 0.0_wp)
            if (.not. friction_alone) then
               if (.not. state(c)%worn) then
                  if (state(c)%bonded) then
                     limit = limit + law%cohesion*table%length(c)
                     if (law%cohesion > law%residual_cohesion) &
                        limit = limit - (law%cohesion - law%residual_cohesion)*broken_length(table, c)
                  else
                     limit = limit + law%residual_cohesion*table%length(c)
                  end if
                  if (pressing < 0 .and. law%tension > 0) limit = max(0.0_wp, limit + law%friction*pressing)
               end if
            end if
            margin = slip_margin(settings, k_s, limit)
            steady(k) = .not. state(c)%tied .and. widest(k) <= settings%open_tolerance .and. table%partner(c) == 0
            if (.not. friction_alone) steady(k) = steady(k) .and. may_be_steady(law)
            if (state(c)%state == contact_state%locked) then
               steady(k) = steady(k) .and. abs(trial) <= limit + margin
               force(2, k) = trial
            else
               steady(k) = steady(k) .and. state(c)%state == contact_state%sliding .and. .not. &
                           (state(c)%bonded .or. state(c)%strikes .or. trial*state(c)%slip_sign < limit - margin)
               force(2, k) = state(c)%slip_sign*limit
            end if
         end associate
      end do
   end subroutine map_steady

   !> Shear force beyond the strength of a joint at which it slides.
   pure real(wp) function slip_margin(settings, k_s, limit) result(margin)
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: k_s        !! [force/length]
      real(wp), intent(in) :: limit      !! its strength [force]
      margin = k_s*settings%round_off
      if (settings%windows_rules) return
      if (limit > nothing*margin) then
         margin = min(margin, hardly*limit)
      else
         margin = nothing*margin
      end if
   end function slip_margin

   !> Does `map_steady` cover the law?
   elemental logical function may_be_steady(law)
      type(joint_law_type), intent(in) :: law
      may_be_steady = law%law == strength_law%coulomb .and. law%friction > 0 .and. .not. law%normal%is_curved()
   end function may_be_steady

   !> Rows that `map_steady` has found steady, after a solve: what is noted of it, what their forces miss of their law,
   !> their normal and their new friction forces.
   pure subroutine keep_steady(n, k_n, gap, force, joint, state_used, sign_used, friction_used, bonded_used, miss, &
                               normal_force)
      integer, intent(in) :: n
      real(wp), intent(in) :: k_n(n), gap(n)           !! [force/length], [length]
      real(wp), intent(in) :: force(2, n)
      type(joint_state_type), intent(inout) :: joint(n)   !! state of the attempt
      integer(i1), intent(inout) :: state_used(n), sign_used(n)
      real(wp), intent(inout) :: friction_used(n)      !! [force]
      logical(l1), intent(inout) :: bonded_used(n)
      real(wp), intent(inout) :: miss(n), normal_force(n)   !! [force]
      integer :: c
      miss = 0
      normal_force = spring_force(k_n, gap)
      do c = 1, n
         state_used(c) = joint(c)%state
         sign_used(c) = joint(c)%slip_sign
         friction_used(c) = joint(c)%friction
         bonded_used(c) = joint(c)%bonded
         if (joint(c)%state == contact_state%sliding) then
            joint(c)%friction = joint(c)%slip_sign*force(2, c)
            miss(c) = abs(joint(c)%friction - friction_used(c))
            cycle
         end if
         ! most are what they were: lines of memory that are not written need not be stored
         if (abs(joint(c)%friction) > 0) joint(c)%friction = 0
         if (joint(c)%slip_sign /= 0) joint(c)%slip_sign = 0
      end do
   end subroutine keep_steady

   !> +1 or -1.
   pure integer function direction(shear)
      real(wp), intent(in) :: shear
      direction = merge(1, -1, shear >= 0)
   end function direction

   !> Force by which a contact that changes its state departs from its law at a motion: the force that the solve gave
   !> it against that of its new state [force].
   pure real(wp) function miss_of_joint(joint, gap, slip, state, slip_sign, friction) result(miss)
      type(joint_type), intent(in) :: joint              !! as in the solve
      real(wp), intent(in) :: gap, slip                  !! [length]
      integer, intent(in) :: state, slip_sign            !! new ones
      real(wp), intent(in) :: friction                   !! of the new state [force]
      real(wp) :: used, due, trial
      trial = elastic_shear(joint, slip)
      used = 0
      if (joint%state == contact_state%locked) used = trial
      if (joint%state == contact_state%sliding) used = joint%slip_sign*joint%friction
      due = 0
      if (state == contact_state%locked) due = trial
      if (state == contact_state%sliding) due = slip_sign*friction
      miss = abs(due - used)
      ! the normal spring came or went
      if (min(state, int(joint%state)) == contact_state%open) miss = miss + abs(spring_force(joint%k_n, gap))
   end function miss_of_joint

   !> Gap beyond which a closed contact opens: its tensile strength t l holds it together.
   pure real(wp) function opening_gap(law, settings, joint)
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      type(joint_type), intent(in) :: joint
      opening_gap = settings%open_tolerance
      opening_gap = opening_gap + tension_at(law, joint%total_slip, logical(joint%bonded))*joint%length/joint%k_n
   end function opening_gap

   !> Friction force of a sliding contact with a given normal force.
   pure real(wp) function sliding_friction(law, settings, joint, normal_force, slip)
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      type(joint_type), intent(in) :: joint
      real(wp), intent(in) :: normal_force   !! compression positive [force]
      real(wp), intent(in) :: slip           !! of the step [length]
      sliding_friction = strength(law, settings, joint, normal_force, joint%bonded .and. .not. law%brittle, slip)
   end function sliding_friction

   !> Shear force of spring and dashpot if the contact did not slide.
   pure real(wp) function elastic_shear(joint, slip)
      type(joint_type), intent(in) :: joint
      real(wp), intent(in) :: slip           !! of the step [length]
      elastic_shear = joint%k_s*(joint%shear + slip) + joint%drag*slip
   end function elastic_shear

   !> Force of a normal spring, compression positive.
   elemental real(wp) function spring_force(k_n, gap)
      real(wp), intent(in) :: k_n            !! [force/length]
      real(wp), intent(in) :: gap            !! [length]
      spring_force = -k_n*gap
   end function spring_force

   !> Energy in the two springs of a closed contact.
   elemental real(wp) function spring_energy(k_n, k_s, gap, shear)
      real(wp), intent(in) :: k_n, k_s       !! [force/length]
      real(wp), intent(in) :: gap, shear     !! elongations [length]
      spring_energy = 0.5_wp*k_n*gap**2 + 0.5_wp*k_s*shear**2
   end function spring_energy

   !> Shear strength with the slip rate of the step.
   pure real(wp) function strength(law, settings, joint, normal_force, bonded, slip)
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      type(joint_type), intent(in) :: joint
      real(wp), intent(in) :: normal_force, slip
      logical, intent(in) :: bonded
      strength = shear_strength(law, normal_force, joint%length, bonded, slip_rate(settings, joint, slip), &
                                joint%total_slip + abs(slip), joint%broken, logical(joint%worn))
   end function strength

   !> Mean speed of the slip in the step, of which the slip where the forces act is a share. Before a step: 0.
   pure real(wp) function slip_rate(settings, joint, slip) result(rate)
      type(joint_settings_type), intent(in) :: settings
      type(joint_type), intent(in) :: joint
      real(wp), intent(in) :: slip           !! where the forces act [length]
      real(wp) :: share
      share = merge(1.0_wp, settings%level, joint%closes)
      rate = 0
      if (share > 0) rate = abs(slip)/(share*settings%dt)
   end function slip_rate

   !> A contact that was closed in the last solve, at the end of the step: what the step leaves in its memory. State,
   !> slip direction and friction force are those of the solve.
   pure subroutine end_joint(k_n, k_s, shear, state, slip_sign, friction, gap, slip, last)
      real(wp), intent(in) :: k_n, k_s             !! [force/length]
      real(wp), intent(in) :: shear                !! elongation at the start of the step [length]
      integer(i1), intent(in) :: state, slip_sign
      real(wp), intent(in) :: friction             !! [force]
      real(wp), intent(in) :: gap, slip            !! [length]
      type(joint_end_type), intent(out) :: last
      real(wp) :: limit
      last%shear = shear + slip
      last%normal_force = spring_force(k_n, gap)
      if (state == contact_state%locked) then
         last%shear_force = -k_s*last%shear
         last%slipped = 0
      else
         limit = friction/k_s
         last%shear = max(-limit, min(limit, last%shear))
         last%shear_force = -slip_sign*friction
         last%slipped = abs(slip)
      end if
      last%energy = spring_energy(k_n, k_s, gap, last%shear)
      last%carried = last%shear
      last%lost = 0
      last%closed = 1
      last%core = [1, 0]
   end subroutine end_joint

   !> Stiffness and load of a contact in its present state, along the normal (1) and the edge (2). The normal force that
   !> friction depends on is left to the iteration, so that the stiffness is symmetric.
   pure subroutine linearise_joint(joint, stiffness, force)
      type(joint_type), intent(in) :: joint
      real(wp), intent(out) :: stiffness(2)   !! [force/length]
      real(wp), intent(out) :: force(2)       !! [force]
      stiffness = 0
      force = 0
      if (joint%state == contact_state%open) return
      stiffness(1) = joint%k_n + joint%normal_drag
      force(1) = -joint%k_n*(joint%gap + joint%late) - joint%normal_drag*((joint%gap + joint%late) - joint%drag_gap)
      if (joint%state == contact_state%locked) then
         stiffness(2) = joint%k_s + joint%drag
         force(2) = -joint%k_s*joint%shear
      else
         force(2) = -joint%slip_sign*joint%friction
      end if
   end subroutine linearise_joint

   !> `linearise_joint` for some rows of the table at the start of the step. Those of an interval that is closed on a
   !> part are coupled along the normal, by the second one.
   pure subroutine linearise_joints(n, rows, table, state, extra, own, cross, push, stiffness, force, coupling)
      integer, intent(in) :: n
      integer, intent(in) :: rows(n)
      type(contact_table_type), intent(in) :: table
      type(joint_state_type), intent(in), contiguous :: state(:)    !! (>= rows)
      type(joint_extra_type), allocatable, intent(in) :: extra(:)   !! (>= rows), or none
      real(wp), intent(in), contiguous :: own(:), cross(:)          !! (>= rows) stiffness of those closed on a part
      real(wp), intent(in), contiguous :: push(:)                   !! (>= rows) their forces at the gaps 0
      real(wp), intent(inout) :: stiffness(2, n), force(2, n)       !! [force/length], [force]
      real(wp), intent(inout) :: coupling(n)                        !! with the next row [force/length]
      type(joint_type) :: joint
      real(wp) :: other, drag_ratio
      integer :: c, d, k
      logical :: has_extra
      has_extra = allocated(extra)
      joint%normal_drag = 0
      joint%drag = 0
      do k = 1, n
         c = rows(k)
         ! what the springs need of `recall_joint`, without a call
         joint%joint_state_type = state(c)
         joint%gap = table%gap(c)
         joint%shear = table%shear(c)
         if (joint%worn) joint%shear = 0
         joint%k_n = table%k_n(c)
         joint%k_s = table%k_s(c)
         if (has_extra) then
            joint%normal_drag = extra(c)%normal_drag
            joint%drag = extra(c)%drag
            joint%drag_gap = extra(c)%drag_gap
            joint%late = extra(c)%late
         end if
         coupling(k) = 0
         if (joint%partly .and. joint%state /= contact_state%open) then
            ! the dashpot acts on the closed part as the spring does
            drag_ratio = joint%normal_drag/joint%k_n
            joint%k_n = own(c)
            joint%normal_drag = drag_ratio*own(c)
            d = other_row(table, c)
            call linearise_joint(joint, stiffness(:, k), force(:, k))
            other = table%gap(d)
            if (has_extra) other = other + extra(d)%late
            force(1, k) = force(1, k) - cross(c)*other + push(c)
            if (has_extra) force(1, k) = force(1, k) - drag_ratio*cross(c)*(other - extra(d)%drag_gap)
            if (c < d) coupling(k) = (1 + drag_ratio)*cross(c)
         else
            call linearise_joint(joint, stiffness(:, k), force(:, k))
         end if
      end do
   end subroutine linearise_joints

end module rockdda_interaction_joint_response
