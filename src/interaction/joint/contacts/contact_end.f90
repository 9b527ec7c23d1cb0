! SPDX-License-Identifier: MIT
!> Contacts at the end of an accepted step: energies of the step, and the table for the next one.
module rockdda_interaction_contact_end
   use rockdda_base_kinds, only : wp
   use rockdda_base_parallel, only : parallel_contacts, n_pieces
   use rockdda_model_state, only : energy
   use rockdda_contact_interval_law, only : end_gaps
   use rockdda_contact_table, only : contact_table_type, contact_state, is_of_interval, other_row
   use rockdda_interaction_attempt, only : attempt_type
   use rockdda_interaction_balance, only : energy_balance_type
   use rockdda_interaction_joint_strength, only : joint_law_type, dilated_gap
   use rockdda_interaction_contact_lengths, only : move_contacts
   use rockdda_interaction_contact_stiffness, only : joint_stiffness_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_intervals, only : find_extremes, interval_response_type, is_two_springs, respond, &
      bond_after, couple_of, slipping_share
   use rockdda_interaction_joint_response, only : joint_end_type, joint_settings_type, joint_type, opening_gap, &
      spring_energy, spring_force
   use rockdda_interaction_open_close, only : open_close_type
   use rockdda_interaction_ties, only : break_ties
   use rockdda_interaction_trial_states, only : piece_of_rows, widest_piece
   implicit none
   private
   public :: joint_end_type, reach_end, find_ends, measure_energies, end_contacts

contains

   !> Springs, friction, dashpots and changes of state of an accepted step.
   subroutine measure_energies(trial, laws, table, twist, ends, d, is_windows, balance)
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)     !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: twist(:)   !! (>= rows) of `share_slips` [length]
      type(joint_end_type), intent(in), contiguous :: ends(:)   !! (>= rows) of `find_ends`
      real(wp), intent(in), contiguous :: d(:, :)          !! (6, nb) unknowns of the step
      logical, intent(in) :: is_windows                    !! the contacts of a preset
      class(energy_balance_type), intent(inout) :: balance
      real(wp) :: carried, friction, dissipated, discarded, geometry, stored
      integer :: p, n, column, c
      n = n_pieces(table%n)
      call balance%make_room(table%n)
      !$omp parallel do default(none) shared(trial, laws, table, twist, ends, d, is_windows, balance, n) &
      !$omp private(p) schedule(static) if (table%n > parallel_contacts)
      do p = 1, n
         call measure_some(p, trial, laws, table, twist, ends, d, is_windows, balance%sums(:, p))
      end do
      !$omp end parallel do
      carried = sum(balance%sums(1, 1:n))
      friction = sum(balance%sums(2, 1:n))
      dissipated = sum(balance%sums(3, 1:n))
      discarded = sum(balance%sums(4, 1:n))
      geometry = sum(balance%sums(5, 1:n))
      stored = sum(balance%sums(6, 1:n))
      ! closed contacts that the search no longer found
      discarded = discarded + (balance%contact_energy - balance%resting_energy - carried)
      balance%contact_energy = stored + balance%resting_energy
      balance%step_discarded = discarded
      balance%most_given = 0
      do column = 1, 2
         if (n == 0) exit
         p = maxloc(balance%sums(5 + 2*column, 1:n), dim=1)
         c = nint(balance%sums(6 + 2*column, p))
         if (c > 0) balance%most_given(:, column) = [balance%sums(5 + 2*column, p), real(table%block_a(c), wp), &
                                                     real(table%block_b(c), wp), table%point(:, c)]
      end do
      call balance%add(energy%external, sum(balance%sums(11, 1:n)))
      call balance%add(energy%friction, friction)
      call balance%add(energy%dissipated, dissipated)
      call balance%add(energy%discarded, discarded)
      call balance%add(energy%geometry, geometry)
   end subroutine measure_energies

   !> The part of `measure_energies` for some of the contacts.
   pure subroutine measure_some(p, trial, laws, table, twist, ends, d, is_windows, sums)
      integer, intent(in) :: p                          !! piece
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: twist(:), d(:, :)
      type(joint_end_type), intent(in), contiguous :: ends(:)
      logical, intent(in) :: is_windows
      !> carried, friction, dissipated, discarded, geometry, stored; what the contact that gives most by a change of
      !> state gives and its number, the same by geometry; work of the couples
      real(wp), intent(out) :: sums(11)
      real(wp) :: lowest(widest_piece), at_start(widest_piece), widest(widest_piece), mean(widest_piece)
      real(wp) :: s0, x1, s1, half, start, before, carried, friction, dissipated, discarded, geometry, stored, worst(4)
      real(wp) :: external, loose
      real(wp) :: gained, level, where_acts, moved, opens
      real(wp) :: used(2), forces(2, 2), stored_before(2)
      integer :: c, first, k, known, last, r
      logical :: was_held, dilates, is_interval, are_springs
      known = 0
      carried = 0
      friction = 0
      dissipated = 0
      discarded = 0
      geometry = 0
      stored = 0
      worst = 0
      external = 0
      dilates = any(laws%dilation > 0)
      are_springs = .not. (dilates .or. allocated(trial%extra) .or. any(laws%normal%is_curved()))
      call piece_of_rows(table, p, first, last)
      call find_extremes(table, first, last, table%gap(first:last), lowest, at_start, mean)
      call find_extremes(table, first, last, trial%gap(first:last), lowest, widest, mean)
      do c = first, last
         s0 = table%shear(c) + twist(c)
         if (trial%joint(c)%worn) s0 = 0
         start = table%energy(c)
         if (abs(twist(c)) > 0 .and. table%station(c) == 1) external = external + &
            dot_product(couple_of(table, twist, c), d(4:6, table%block_a(c)) - d(4:6, table%block_b(c)))
         associate (after => ends(c), was_closed => table%state(c) /= contact_state%open, &
                    x0 => table%gap(c), kn => table%k_n(c), ks => table%k_s(c))
            ! a corner that has passed the other one stands off from it: its spring has nothing to give
            k = c - first + 1
            if (are_springs .and. trial%state_used(c) == contact_state%locked .and. was_closed .and. &
                .not. table%closed(c) < 1 .and. &
                .not. abs(twist(c)) > 0 .and. at_start(k) <= 0 .and. widest(k) <= 0 .and. .not. &
                trial%partly_used(c)) then
               ! locked and closed on all its length, at the start, in the solve and at the end: two springs like others
               before = 0.5_wp*kn*x0**2 + 0.5_wp*ks*s0**2
               carried = carried + start
               geometry = geometry + (before - start)
               if (before - start > worst(3)) worst(3:4) = [before - start, real(c, wp)]
               half = trial%level(trial%start(c)) - 0.5_wp
               dissipated = dissipated + half*kn*(trial%gap(c) - x0)**2
               dissipated = dissipated + shear_loss(ks, half + 0.5_wp, s0, trial%slip(c), &
                                                    stretch(trial, table, twist, c))
               stored = stored + after%energy
               cycle
            end if
            carried = carried + start
            was_held = was_closed .and. (x0 <= 0 .or. trial%joint(c)%bonded .or. is_windows .or. &
                                         laws(table%joint(c))%residual_tension > 0)
            before = 0
            is_interval = is_of_interval(table, c) .and. .not. table%tied(c)
            was_held = was_held .or. (was_closed .and. is_interval)
            if (was_closed) before = spring_energy(kn, ks, merge(x0, 0.0_wp, was_held), s0)
            if (is_interval .and. (was_closed .or. trial%state_used(c) /= contact_state%open)) then
               ! forces of its springs at the start, and where they act in the step
               r = c + 1 - table%station(c)
               if (known /= r) call interval_forces(trial, laws(table%joint(c)), table, r, forces, stored_before)
               known = r
               if (was_closed) before = stored_before(table%station(c)) + 0.5_wp*ks*s0**2
               loose = (1 - table%closed(c))*0.5_wp*ks*s0**2
               discarded = discarded - loose
               start = start + loose
            end if
            geometry = geometry + (before - start)
            if (before - start > worst(3)) worst(3:4) = [before - start, real(c, wp)]
            if (trial%state_used(c) == contact_state%open) then
               discarded = discarded + before
               cycle
            end if
            x1 = trial%gap(c)
            s1 = after%shear
            opens = 0
            if (dilates) opens = trial%extra(c)%opens
            moved = (x1 - x0) + opens
            level = trial%level(trial%start(c))
            half = level - 0.5_wp
            if (is_interval) then
               used = [forces(table%station(c), 1), forces(table%station(c), 2)]
               gained = 0
               if (dilates) gained = 0.5_wp*(merge(used(1), 0.0_wp, was_closed) + after%normal_force)*opens
               friction = friction - gained
               dissipated = dissipated - used(2)*moved - (after%energy + after%lost - 0.5_wp*ks*s1**2) + gained
               discarded = discarded + after%lost
               if (was_closed) dissipated = dissipated + (before - 0.5_wp*ks*s0**2)
            else if (was_held .or. x0 < 0) then
               if (dilates) then
                  ! the spring presses blocks apart while it keeps its force: the work of that is friction's
                  gained = -0.5_wp*kn*(x0 + x1)*opens
                  friction = friction - gained
                  dissipated = dissipated + (kn*(x0 + level*moved + trial%extra(c)%late)*moved - &
                                             0.5_wp*kn*(x1**2 - x0**2) + gained)
               else
                  dissipated = dissipated + half*kn*(x1 - x0)**2
               end if
               if (.not. was_closed) then
                  discarded = discarded - 0.5_wp*kn*x0**2
                  if (0.5_wp*kn*x0**2 > worst(1)) worst(1:2) = [0.5_wp*kn*x0**2, real(c, wp)]
               end if
            else
               where_acts = x1
               if (level < 1) where_acts = x0 + level*moved
               if (dilates) where_acts = where_acts + trial%extra(c)%late
               dissipated = dissipated + (kn*where_acts*moved - 0.5_wp*kn*x1**2)
            end if
            if (is_interval) then
               if (allocated(trial%extra)) dissipated = dissipated + drag_force(trial, table, c)*moved
            else if (dilates .and. was_closed) then
               where_acts = x0 + level*moved + trial%extra(c)%late
               dissipated = dissipated + trial%extra(c)%normal_drag*(where_acts - trial%extra(c)%drag_gap)*moved
            else if (allocated(trial%extra)) then
               dissipated = dissipated + level*trial%extra(c)%normal_drag*(x1 - trial%extra(c)%drag_gap)*(x1 - x0)
            end if
            if (trial%state_used(c) == contact_state%locked) then
               dissipated = dissipated + shear_loss(ks, level, s0, trial%slip(c), stretch(trial, table, twist, c))
               ! what the rows differ by has acted by its couple alone
               if (.not. trial%joint(c)%worn) external = external + ks*twist(c)*trial%slip(c)
               if (allocated(trial%extra)) dissipated = dissipated + level*trial%extra(c)%drag*trial%slip(c)**2
            else
               friction = friction + trial%sign_used(c)*trial%friction_used(c)*trial%slip(c) - &
                          0.5_wp*ks*(s1**2 - s0**2)
            end if
            if (trial%opened(c)) then
               discarded = discarded + after%energy
               cycle
            end if
            stored = stored + after%energy
            if (.not. dilates) cycle
            gained = dilation_energy(laws(table%joint(c)), merge(0.0_wp, kn, is_interval), after%normal_force, &
                                     table%total_slip(c), after%slipped, opens)
            friction = friction - gained
            stored = stored + gained
         end associate
      end do
      sums = [carried, friction, dissipated, discarded, geometry, stored, worst, external]
   end subroutine measure_some

   !> Work against a shear spring less what it stores: it acts after a share of its slip, and is stretched by the mean
   !> slip of its interval.
   pure real(wp) function shear_loss(ks, level, before, slip, stretched) result(loss)
      real(wp), intent(in) :: ks                       !! [force/length]
      real(wp), intent(in) :: level                    !! share of the slip
      real(wp), intent(in) :: before, slip, stretched  !! elongation at the start; of the step [length]
      loss = ks*(before*(slip - stretched) + level*slip**2 - 0.5_wp*stretched**2)
   end function shear_loss

   !> What a step adds to the elongation of the shear spring of a locked row (`find_some_ends`), without the rounding of
   !> the elongation.
   pure real(wp) function stretch(trial, table, twist, c)
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: twist(:)     !! (>= rows) of `share_slips` [length]
      integer, intent(in) :: c                         !! row
      integer :: d
      stretch = trial%slip(c)
      if (.not. is_of_interval(table, c) .or. table%tied(c) .or. trial%joint(c)%worn) return
      d = other_row(table, c)
      if (trial%state_used(d) == contact_state%locked .and. .not. trial%joint(d)%worn) then
         stretch = 0.5_wp*(stretch + trial%slip(d))
      else
         stretch = stretch - twist(c)
      end if
   end function stretch

   !> Energy that the normal spring gains when a slip opens the joint, further than was expected of the step: what it
   !> presses apart. Dilation takes it from the shear work, so that friction dissipates the less.
   pure real(wp) function dilation_energy(law, kn, force, slip_before, slipped, expected) result(gained)
      type(joint_law_type), intent(in) :: law
      real(wp), intent(in) :: kn              !! by which its force grows; 0 of intervals: to first order [force/length]
      real(wp), intent(in) :: force           !! of the spring at the end of the step, compression positive [force]
      real(wp), intent(in) :: slip_before, slipped   !! summed up, and in the step [length]
      real(wp), intent(in) :: expected        !! opening in the step [length]
      real(wp) :: opened
      gained = 0
      if (.not. law%dilation > 0) return
      opened = dilated_gap(law, slip_before + slipped) - dilated_gap(law, slip_before) - expected
      gained = (force + 0.5_wp*kn*opened)*opened
   end function dilation_energy

   !> From the motion where forces have acted to that of the end of the step. What is apart there is open from then on.
   subroutine reach_end(trial, table, laws, settings)
      type(open_close_type), intent(inout) :: trial
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: laws(:)  !! per joint material
      type(joint_settings_type), intent(in) :: settings
      type(joint_type) :: joint
      integer :: c
      do c = 1, table%n
         trial%gap(c) = trial%gap_at_end(table, c)
         trial%slip(c) = trial%slip(c)/trial%level(trial%start(c))
         if (trial%state_used(c) == contact_state%open .or. table%tied(c)) cycle
         if (is_of_interval(table, c)) cycle
         call trial%recall(table, c, joint)
         trial%opened(c) = trial%gap(c) > opening_gap(laws(table%joint(c)), settings, joint)
      end do
      do c = 1, table%n
         if (table%station(c) /= 1 .or. trial%state_used(c) == contact_state%open .or. table%tied(c)) cycle
         trial%opened(c:c + 1) = minval(end_gaps(trial%gap(c:c + 1))) > settings%open_tolerance .and. .not. &
                                 (trial%bond(c + 1) > trial%bond(c) .and. laws(table%joint(c))%tension > 0)
      end do
   end subroutine reach_end

   !> Contacts that were closed in the last solve, at the end of the step.
   subroutine find_ends(trial, laws, table, twist, is_static, ends)
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(contact_table_type), intent(in) :: table   !! of the step's start
      real(wp), intent(in), contiguous :: twist(:)   !! (>= rows) of `share_slips` [length]
      logical, intent(in) :: is_static              !! the closed part may change
      type(joint_end_type), allocatable, intent(inout) :: ends(:)   !! (>= rows)
      integer :: p
      if (allocated(ends)) then
         if (size(ends) < table%n) deallocate (ends)
      end if
      if (.not. allocated(ends)) allocate (ends(table%n + table%n/4))
      !$omp parallel do default(none) shared(trial, laws, table, twist, is_static, ends) private(p) &
      !$omp schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call find_some_ends(p, trial, laws, table, twist, is_static, ends)
      end do
      !$omp end parallel do
   end subroutine find_ends

   !> The table becomes that of the step's end; ties that have reached their strength break. What the springs gain by
   !> dilation is theirs from here on.
   subroutine end_contacts(trial, laws, stiffness, context, attempt, d, ends, table)
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)         !! per joint material
      type(joint_stiffness_type), intent(in) :: stiffness
      type(step_context_type), intent(inout) :: context
      type(attempt_type), intent(inout) :: attempt
      real(wp), intent(in), contiguous :: d(:, :)           !! (6, nb) unknowns of the step
      type(joint_end_type), intent(in), contiguous :: ends(:)   !! (>= rows) of `find_ends`
      type(contact_table_type), intent(inout) :: table
      real(wp), allocatable :: before(:)
      integer :: c
      if (any(laws%dilation > 0)) before = table%total_slip(1:table%n)
      call commit(trial, laws, ends, table)
      call commit_bonds(trial, laws, table)
      if (context%parameters%by_length) call attempt%find_moved(context, d)
      call move_contacts(trial%gap, attempt%moved, table)
      if (any(context%parameters%joint_materials%tie)) call break_ties(laws, stiffness, table, trial%gap)
      if (.not. allocated(before)) return
      do c = 1, table%n
         if (trial%state_used(c) == contact_state%open .or. trial%opened(c)) cycle
         table%energy(c) = table%energy(c) + dilation_energy(laws(table%joint(c)), merge(0.0_wp, table%k_n(c), &
                                                             is_of_interval(table, c)), table%normal_force(c), &
                                                                before(c), &
                                                             table%total_slip(c) - before(c), trial%extra(c)%opens)
      end do
   end subroutine end_contacts

   !> States, forces and memory of the contacts at the step's end.
   subroutine commit(trial, laws, ends, table)
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(joint_end_type), intent(in), contiguous :: ends(:)
      type(contact_table_type), intent(inout) :: table
      integer :: p
      !$omp parallel do default(none) shared(trial, laws, ends, table) private(p) schedule(static) &
      !$omp if (table%n > parallel_contacts)
      do p = 1, n_pieces(table%n)
         call commit_rows(p, trial, laws, ends, table)
      end do
      !$omp end parallel do
   end subroutine commit

   !> Where the bonds of intervals are sound at the step's end.
   pure subroutine commit_bonds(trial, laws, table)
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(contact_table_type), intent(inout) :: table
      integer :: c
      if (.not. any(laws%tension > 0 .or. laws%cohesion > laws%residual_cohesion)) return
      do c = 1, table%n
         if (table%station(c) /= 1 .or. table%tied(c)) cycle
         if (table%state(c) == contact_state%open) then
            table%bond_end(c:c + 1) = 0
         else
            table%bond_end(c:c + 1) = bond_after(laws(table%joint(c)), trial%bond(c:c + 1), trial%gap(c:c + 1))
         end if
      end do
   end subroutine commit_bonds

   !> `find_ends` for some of the rows: those of intervals with what is closed there.
   pure subroutine find_some_ends(p, trial, laws, table, twist, is_static, ends)
      integer, intent(in) :: p                        !! piece
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)   !! per joint material
      type(contact_table_type), intent(in) :: table
      real(wp), intent(in), contiguous :: twist(:)   !! (>= rows) of `share_slips` [length]
      logical, intent(in) :: is_static
      type(joint_end_type), intent(inout), contiguous :: ends(:)   !! (>= rows)
      type(interval_response_type) :: interval
      real(wp) :: bond(2), slipped(2), after
      integer :: c, first, i, last
      call piece_of_rows(table, p, first, last)
      call trial%find_ends(table, first, last, ends(first:last))
      do c = first, last
         if (table%station(c) /= 1 .or. table%tied(c)) cycle
         if (any(trial%state_used(c:c + 1) /= contact_state%locked .or. trial%joint(c:c + 1)%worn)) cycle
         ! the slips of both rows differ by the turn of the normal between them
         slipped = 0.5_wp*(ends(c)%shear + ends(c + 1)%shear) + twist(c:c + 1)
         ends(c:c + 1)%energy = ends(c:c + 1)%energy + &
                                0.5_wp*table%k_s(c:c + 1)*(slipped**2 - ends(c:c + 1)%shear**2)
         ends(c:c + 1)%shear = slipped
         ends(c:c + 1)%carried = slipped
         ends(c:c + 1)%shear_force = -table%k_s(c:c + 1)*slipped
      end do
      do c = first, last
         if (table%station(c) /= 1 .or. trial%state_used(c) == contact_state%open .or. table%tied(c)) cycle
         if (is_two_springs(laws(table%joint(c)), trial%gap(c:c + 1)) .and. .not. table%closed(c) < 1) cycle
         bond = trial%bond(c:c + 1)
         call respond(laws(table%joint(c)), table, c, trial%both_bonded(c), trial%gap(c:c + 1), 0.0_wp, bond, interval)
         after = table%closed(c)
         if (is_static) after = slipping_share(laws(table%joint(c)), after, interval%part)
         do i = 1, 2
            associate (joint_end => ends(c + i - 1), k_s => table%k_s(c + i - 1))
               joint_end%normal_force = interval%force(i)
               joint_end%energy = 0.5_wp*k_s*joint_end%shear**2 + interval%energy(i)
               joint_end%core = table%core(:, c + i - 1)
               call change_closed_part(k_s, table%closed(c), after, &
                                       joint_end%shear - table%shear(c + i - 1) - twist(c + i - 1), &
                                       trial%state_used(c + i - 1) == contact_state%sliding, joint_end)
               if (trial%state_used(c + i - 1) == contact_state%locked) &
                  joint_end%shear_force = -k_s/table%closed(c)*joint_end%carried
            end associate
         end do
      end do
   end subroutine find_some_ends

   !> The shear spring of an interval of which more or less is closed at the end of a step. What closes begins without
   !> force, and has none again where it opens at the slip at which it closed: only what has been closed all the time,
   !> the core, takes its share of the force with it. The energy for the next step is that of the mean elongation; what
   !> is beyond counts as discarded until that step.
   pure subroutine change_closed_part(k_s, before, after, stretched, slides, last)
      real(wp), intent(in) :: k_s              !! of what was closed [force/length]
      real(wp), intent(in) :: before, after    !! shares of the interval, > 0
      real(wp), intent(in) :: stretched        !! elongation in the step [length]
      logical, intent(in) :: slides
      type(joint_end_type), intent(inout) :: last   !! with the core before the step
      last%carried = before*last%shear
      associate (core => last%core)
         if (slides .or. core(1) >= before) then
            core = [before, last%shear]
         else
            core(2) = core(2) + stretched
         end if
         if (after < core(1)) then
            last%carried = last%carried - core(2)*(core(1) - after)
            core(1) = after
         end if
      end associate
      last%closed = after
      last%lost = 0.5_wp*k_s*(last%shear**2 - last%carried**2/before)
      last%energy = last%energy - last%lost
   end subroutine change_closed_part

   !> `commit` for some of the rows.
   pure subroutine commit_rows(p, trial, laws, ends, table)
      integer, intent(in) :: p                        !! piece
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: laws(:)
      type(joint_end_type), intent(in), contiguous :: ends(:)
      type(contact_table_type), intent(inout) :: table
      real(wp) :: slip
      integer :: c, first, last
      call piece_of_rows(table, p, first, last)
      do c = first, last
         table%bonded(c) = trial%joint(c)%bonded
         if (table%closed(c) < 1) table%k_s(c) = table%k_s(c)/table%closed(c)
         if (trial%state_used(c) == contact_state%open .or. trial%opened(c)) then
            ! a contact that would close after the last solve has no spring yet
            slip = table%total_slip(c)
            call table%open_row(c)
            ! faces that part for a moment pass over their asperities as before, unless they are well apart
            associate (opening => dilated_gap(laws(table%joint(c)), slip))
               if (opening > max(0.0_wp, trial%gap(c))) table%total_slip(c) = slip + abs(trial%slip(c))
            end associate
            cycle
         end if
         associate (joint_end => ends(c))
            table%state(c) = trial%joint(c)%state
            table%slip_sign(c) = trial%joint(c)%slip_sign
            table%shear(c) = joint_end%carried
            table%normal_force(c) = joint_end%normal_force
            table%shear_force(c) = joint_end%shear_force
            table%total_slip(c) = table%total_slip(c) + joint_end%slipped
            table%energy(c) = joint_end%energy
            table%closed(c) = joint_end%closed
            table%core(:, c) = joint_end%core
         end associate
      end do
   end subroutine commit_rows

   !> Forces of the springs of an interval: (rows, at the start of the step and where they act in it), and their
   !> energies at the start.
   pure subroutine interval_forces(trial, law, table, c, forces, energy)
      type(open_close_type), intent(in) :: trial
      type(joint_law_type), intent(in) :: law
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c                    !! first row
      real(wp), intent(out) :: forces(2, 2)
      real(wp), intent(out) :: energy(2)
      type(interval_response_type) :: interval
      real(wp) :: where_acts(2), bond(2)
      integer :: i
      bond = table%bond_end(c:c + 1)
      call respond(law, table, c, logical(table%bonded(c) .and. table%bonded(c + 1)), &
                   table%gap(c:c + 1), 0.0_wp, bond, interval)
      forces(:, 1) = interval%force
      energy = interval%energy
      do i = 1, 2
         where_acts(i) = acting_gap(trial, table, c + i - 1)
      end do
      if (trial%partly_used(c)) then
         forces(:, 2) = trial%push_used(c:c + 1) - (trial%own_used(c:c + 1)*where_acts + &
                                                    trial%cross_used(c)*where_acts([2, 1]))
      else
         forces(:, 2) = spring_force(table%k_n(c:c + 1), where_acts)
      end if
   end subroutine interval_forces

   !> Gap at which the spring of a contact acts in the step, by that at its end.
   pure real(wp) function acting_gap(trial, table, c) result(gap)
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      real(wp) :: opens, late
      opens = 0
      late = 0
      if (allocated(trial%extra)) opens = trial%extra(c)%opens
      if (allocated(trial%extra)) late = trial%extra(c)%late
      gap = table%gap(c) + trial%level(trial%start(c))*((trial%gap(c) - table%gap(c)) + opens) + late
   end function acting_gap

   !> Force of the dashpot of a row of an interval.
   pure real(wp) function drag_force(trial, table, c) result(force)
      type(open_close_type), intent(in) :: trial
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c
      integer :: d
      force = trial%extra(c)%normal_drag*(acting_gap(trial, table, c) - trial%extra(c)%drag_gap)
      if (.not. trial%partly_used(c)) return
      d = other_row(table, c)
      force = (trial%own_used(c)/table%k_n(c))*force + trial%extra(c)%normal_drag*(trial%cross_used(c)/table%k_n(c))* &
              (acting_gap(trial, table, d) - trial%extra(d)%drag_gap)
   end function drag_force

end module rockdda_interaction_contact_end
