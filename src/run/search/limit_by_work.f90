! SPDX-License-Identifier: MIT
!> Where is the limit, by the work in the last step of a trial that fails?
!>
!> At the end of a static step inertia takes what no other force holds. Its work P along the motion of the step is zero
!> at the limit. What the searched quantity does to P is known when normal forces and mechanism stay as they are: the
!> friction of the searched joints, of work R, is R f/F at a factor F instead of f, so that P is zero at f R/(R + P);
!> loads whose direction changes do more work. It is a guess, by which a search chooses the next value to try.
module rockdda_run_limit_by_work
   use rockdda_base_kinds, only : wp, pi
   use rockdda_contact_table, only : contact_state
   use rockdda_model_state, only : radius_of_inertia
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_run_search_options, only : search_kind
   use rockdda_run_searched, only : searched_type
   implicit none
   private
   public :: find_limit

contains

   !> The work of inertia in the last, static step over the motion of all areas, which is what carries a mechanism away,
   !> and the value at which it would be none; 0: not known.
   subroutine find_limit(sim, searched, value, pull, limit)
      type(simulation_type), intent(in) :: sim
      type(searched_type), intent(in) :: searched
      real(wp), intent(in) :: value
      real(wp), intent(out) :: pull              !! [force/area]
      real(wp), intent(out) :: limit
      real(wp) :: work, moved, change, turned(2)
      integer :: i
      limit = 0
      work = 0
      moved = 0
      change = 0
      associate (d => sim%equations%x, weight => sim%families%loads%weight, state => sim%state)
         do i = 1, sim%blocks%n_blocks
            if (.not. state%active(i)) cycle
            work = work + state%mass(i)*(dot_product(state%acceleration(1:2, i), d(1:2, i)) + &
                                         radius_of_inertia(state, i)**2*state%acceleration(3, i)*d(3, i))
            moved = moved + state%area(i)*(norm2(d(1:2, i)) + radius_of_inertia(state, i)*abs(d(3, i)))
            select case (searched%kind)
            case (search_kind%tilt)
               turned = [-weight(2, i), weight(1, i)]*pi/180
            case (search_kind%push)
               turned = [-weight(2, i), 0.0_wp]
            case default
               turned = 0
            end select
            change = change + dot_product(turned, d(1:2, i))
         end do
      end associate
      select case (searched%kind)
      case (search_kind%strength)
         change = friction_work(sim, searched%joints)
         if (change > 0 .and. work > 0) limit = value*change/(change + work)
      case (search_kind%tilt, search_kind%push)
         if (abs(change) > 0 .and. work > 0) limit = value - work/change
      end select
      pull = work/max(moved, tiny(1.0_wp))
   end subroutine find_limit

   !> Work of the shear forces of searched joints that slide in the last step.
   pure real(wp) function friction_work(sim, joints) result(work)
      type(simulation_type), intent(in) :: sim
      logical, intent(in) :: joints(:)           !! joint materials
      integer :: c
      work = 0
      associate (table => sim%contacts, slip => sim%families%contacts%trial%slip)
         do c = 1, table%n
            if (table%state(c) == contact_state%sliding .and. joints(table%joint(c))) &
               work = work + abs(table%shear_force(c)*slip(c))
         end do
      end associate
   end function friction_work

end module rockdda_run_limit_by_work
