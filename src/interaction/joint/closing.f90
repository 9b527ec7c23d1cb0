! SPDX-License-Identifier: MIT
!> Whether a contact is open or closed at the end of a motion, by its gap and that of its partner.
module rockdda_interaction_closing
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_table_type, contact_state
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_joint_response, only : joint_settings_type, joint_state_type, joint_type, opening_gap
   implicit none
   private
   public :: stays_closed, closing_gap

contains

   !> Is a contact closed at the end of a motion? An open one must close, a closed one must not open.
   pure logical function stays_closed(joint, states, table, law, settings, c, gap, partner_gap)
      type(joint_type), intent(in) :: joint           !! of row c
      type(joint_state_type), intent(in), contiguous :: states(:)   !! (>= rows)
      type(contact_table_type), intent(in) :: table
      type(joint_law_type), intent(in) :: law
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap        !! the partner's is not used without one [length]
      real(wp) :: limit, between
      integer :: p
      stays_closed = .true.
      if (joint%tied) return
      if (joint%state == contact_state%open) then
         stays_closed = closes(states, table, settings, c, gap, partner_gap)
         return
      end if
      limit = settings%open_tolerance
      if (((joint%bonded .and. law%tension > 0) .or. law%residual_tension > 0) .and. .not. joint%worn) &
         limit = opening_gap(law, settings, joint)
      stays_closed = .not. gap > limit
      ! outside the partner's line: the corner has been passed
      p = table%partner(c)
      if (p == 0) return
      between = partner_gap + table%offset(p)
      if (between > settings%open_tolerance .and. between > gap + table%offset(c)) stays_closed = .false.
   end function stays_closed

   !> Gap of the springs below which an open contact closes. The tolerance counts from where the blocks touch: what the
   !> offset has used up of it is gone.
   pure real(wp) function closing_gap(settings, offset, strikes)
      type(joint_settings_type), intent(in) :: settings
      real(wp), intent(in) :: offset   !! gap that is free of force [length]
      logical, intent(in) :: strikes   !! it never closes in this attempt
      if (strikes) then
         closing_gap = -huge(closing_gap)
         return
      end if
      closing_gap = -max(settings%close_tolerance + min(0.0_wp, offset), &
                         min(settings%close_tolerance, settings%open_tolerance))
   end function closing_gap

   !> Does an open contact close with this motion?
   pure logical function closes(states, table, settings, c, gap, partner_gap)
      type(joint_state_type), intent(in), contiguous :: states(:)   !! (>= rows)
      type(contact_table_type), intent(in) :: table
      type(joint_settings_type), intent(in) :: settings
      integer, intent(in) :: c                        !! row
      real(wp), intent(in) :: gap, partner_gap        !! the partner's is not used without one [length]
      real(wp) :: start(2), between(2)                !! of the contact and its partner, offsets left aside [length]
      integer :: p
      closes = .false.
      if (gap >= closing_gap(settings, table%offset(c), logical(states(c)%strikes))) return
      p = table%partner(c)
      if (p > 0) then
         ! inside only when behind both lines; the line with the larger gap closes: through it is the shorter way out
         if (states(p)%state /= contact_state%open) return
         between = [gap + table%offset(c), partner_gap + table%offset(p)]
         if (between(2) >= -settings%close_tolerance) return
         start = [table%gap(c) + table%offset(c), table%gap(p) + table%offset(p)]
         if (minval(start) < -settings%close_tolerance) then
            ! behind one of them from the start: the corner comes through the other
            if (start(1) < start(2)) return
            if (start(1) <= start(2) .and. p < c) return
         else
            if (between(1) < between(2)) return
            if (between(1) <= between(2) .and. p < c) return
         end if
      end if
      closes = .true.
   end function closes

end module rockdda_interaction_closing
