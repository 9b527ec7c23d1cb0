! SPDX-License-Identifier: MIT
!> How far each bolt and lining is mobilised at the end of a trial, and whether bolts could hold what fails.
module rockdda_run_support_uses
   use rockdda_base_kinds, only : wp
   use rockdda_contact_table, only : contact_state
   use rockdda_interaction_kinematics, only : displacement_at
   use rockdda_model_bolt_layout, only : name_of_spring
   use rockdda_model_state, only : bolt_nodes_type, liner_nodes_type
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: support_use_type, find_uses, name_of_support, n_bolts_of, state_word, find_unused, find_pushed, &
      friction_work

   !> What bolts could do is an estimate: forces turn, and joints yield, on the way on which they come to bear.
   real(wp), parameter :: large_share = 0.5_wp
   !> Shares of a strength below this are those of bolts without a limit.
   real(wp), parameter :: no_share = 1.0e-100_wp

   !> One bolt or lining.
   type :: support_use_type
      real(wp) :: force = 0     !! largest axial force, tension positive, of a lining per metre [force]
      real(wp) :: use = 0       !! largest share of a strength; not above 0: none is known
      integer :: state = 0      !! furthest state of its nodes; 0: it is not there
   end type support_use_type

contains

   !> All springs, bolts and linings, in this order.
   subroutine find_uses(sim, uses)
      type(simulation_type), intent(in) :: sim
      type(support_use_type), allocatable, intent(out) :: uses(:)
      type(bolt_nodes_type) :: bolts
      type(liner_nodes_type) :: liners
      integer :: k, n, last
      n = sim%blocks%bolts%n
      allocate (uses(n_bolts_of(sim) + size(sim%families%liners%liners)))
      if (size(uses) == 0) return
      call sim%show_bolts(bolts)
      do k = 1, n
         uses(k) = support_use_type(bolts%force(k), 0.0_wp, 1)
         associate (strength => sim%blocks%bolts%strength(k))
            if (strength > 0) uses(k)%use = abs(bolts%force(k))/strength
            if (strength > 0 .and. .not. uses(k)%use < 1) uses(k)%state = 3
         end associate
      end do
      last = n
      do k = 1, n_bolts_of(sim) - n
         associate (bar => sim%families%bars%bolts(k)%bar)
            uses(n + k) = of_nodes(bolts%force(last + 1:last + bar%n), bolts%use(last + 1:last + bar%n), &
                                   bolts%state(last + 1:last + bar%n))
            last = last + bar%n
         end associate
      end do
      if (sim%families%liners%n_nodes() == 0) return
      call sim%show_liners(liners)
      n = n_bolts_of(sim)
      last = 0
      do k = 1, size(uses) - n
         associate (m => sim%families%liners%liners(k)%layout%n)
            uses(n + k) = of_nodes(liners%force(1, last + 1:last + m), liners%use(last + 1:last + m), &
                                   liners%state(last + 1:last + m))
            last = last + m
         end associate
      end do
   end subroutine find_uses

   !> The furthest that nodes have come.
   pure type(support_use_type) function of_nodes(force, use, state) result(one)
      real(wp), intent(in) :: force(:), use(:)
      integer, intent(in) :: state(:)
      if (size(state) == 0) return
      one = support_use_type(force(maxloc(abs(force), dim=1)), maxval(use), maxval(state))
      if (one%use < no_share) one%use = 0
   end function of_nodes

   !> Springs and bolts.
   pure integer function n_bolts_of(sim) result(n)
      type(simulation_type), intent(in) :: sim
      n = sim%blocks%bolts%n
      if (sim%families%bars%n_nodes() > 0) n = n + size(sim%families%bars%bolts)
   end function n_bolts_of

   !> Name of one of them.
   pure function name_of_support(sim, k) result(name)
      type(simulation_type), intent(in) :: sim
      integer, intent(in) :: k
      character(len=:), allocatable :: name
      associate (n_springs => sim%blocks%bolts%n, n_bolts => n_bolts_of(sim))
         if (k > n_bolts) then
            name = sim%families%liners%liners(k - n_bolts)%name
         else if (k > n_springs) then
            name = sim%families%bars%bolts(k - n_springs)%name
         else
            name = name_of_spring(sim%parameters%bolts, n_springs, k)
         end if
      end associate
   end function name_of_support

   !> What a bolt, or a lining, is.
   pure function state_word(state, is_lining) result(word)
      integer, intent(in) :: state
      logical, intent(in) :: is_lining
      character(len=:), allocatable :: word
      character(len=8), parameter :: of_bolt(0:4) = ['absent  ', 'elastic ', 'slipping', 'yielding', 'ruptured']
      character(len=8), parameter :: of_lining(0:3) = ['absent  ', 'sound   ', 'cracked ', 'crushed ']
      if (is_lining) then
         word = trim(of_lining(state))
      else
         word = trim(of_bolt(state))
      end if
   end function state_word

   !> Bolts in compression by a large share of their strength; of those without a limit, of the largest bolt force.
   pure function find_pushed(bolts) result(pushed)
      type(support_use_type), intent(in) :: bolts(:)
      integer, allocatable :: pushed(:)
      integer :: k
      pushed = pack([(k, k=1, size(bolts))], bolts%force < 0 .and. &
                    merge(bolts%use >= large_share, -bolts%force >= large_share*maxval(abs(bolts%force)), &
                          bolts%use > 0))
   end function find_pushed

   !> Could elastic bolts hold what the last step, a static one, has moved? They do a large share of the work of inertia
   !> there, `work`, if they bear their strength, by their stretch and by the friction of the joints that they press
   !> together. Then the bolt whose strength would do most of it beyond its force; else 0.
   pure integer function find_unused(sim, uses, work) result(most)
      type(simulation_type), intent(in) :: sim
      type(support_use_type), intent(in) :: uses(:)
      real(wp), intent(in) :: work                   !! [energy]
      real(wp) :: unused(n_bolts_of(sim)), way, friction, motion(2), before(2)
      integer :: j, k, n
      most = 0
      if (size(unused) == 0) return
      unused = 0
      friction = mean_friction(sim)
      n = sim%blocks%bolts%n
      do k = 1, size(unused)
         if (uses(k)%state /= 1 .or. .not. abs(uses(k)%force) > 0) cycle
         if (k <= n) then
            associate (ends => sim%state%bolt_ends(:, k), b => sim%blocks%bolts%blocks(:, k))
               way = held_way(motion_of(b(2), ends(3:4)) - motion_of(b(1), ends(1:2)), ends(3:4) - ends(1:2))
            end associate
         else
            way = 0
            associate (bolt => sim%families%bars%bolts(k - n))
               do j = 1, size(bolt%acting)
                  motion = motion_of(bolt%block(bolt%acting(j)), bolt%place(:, bolt%acting(j)))
                  if (j > 1) way = way + held_way(motion - before, &
                                                  bolt%place(:, size(bolt%place, 2)) - bolt%place(:, 1))
                  before = motion
               end do
               way = way/bolt%spacing
            end associate
         end if
         unused(k) = huge(1.0_wp)
         if (uses(k)%use > 0) unused(k) = abs(uses(k)%force)*(1/uses(k)%use - 1)
         unused(k) = min(unused(k), sqrt(huge(1.0_wp)))*way
      end do
      if (sum(unused) >= large_share*work) most = maxloc(unused, 1)

   contains

      !> Of a point with its block in the step; the outside stays.
      pure function motion_of(block, point) result(u)
         integer, intent(in) :: block
         real(wp), intent(in) :: point(2)
         real(wp) :: u(2)
         u = 0
         if (block > 0) u = displacement_at(sim%equations%x(:, block), point, sim%state%centroid(:, block))
      end function motion_of

      !> The work of a unit force in a bolt that a relative motion stretches, with the friction that it causes.
      pure real(wp) function held_way(motion, axis) result(way)
         real(wp), intent(in) :: motion(2), axis(2)
         way = dot_product(motion, axis)/norm2(axis)
         if (way > 0) way = way + friction*abs(motion(1)*axis(2) - motion(2)*axis(1))/norm2(axis)
         way = max(0.0_wp, way)
      end function held_way

   end function find_unused

   !> Friction over normal force in the joints that slide in the last step, by the work that they do.
   pure real(wp) function mean_friction(sim) result(mean)
      type(simulation_type), intent(in) :: sim
      real(wp) :: pressed
      integer :: c
      pressed = 0
      associate (table => sim%contacts, slip => sim%families%contacts%trial%slip)
         do c = 1, table%n
            if (table%state(c) == contact_state%sliding) pressed = pressed + abs(table%normal_force(c)*slip(c))
         end do
      end associate
      mean = friction_work(sim, [(.true., c=1, size(sim%parameters%joint_materials))])/max(pressed, tiny(1.0_wp))
   end function mean_friction

   !> Work of the shear forces of some joints that slide in the last step.
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

end module rockdda_run_support_uses
