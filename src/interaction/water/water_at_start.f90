! SPDX-License-Identifier: MIT
!> Pressure of the water at time 0, as contacts and boundaries need it to begin in balance.
!>
!> The stress of the blocks at the start is the total one. What springs carry of it is the effective part, without
!> the water that presses on both sides of the joint. Along an interval the springs of contacts can only represent a
!> traction that is linear; the water takes the place of the linear one with the same force and moment. With
!>
!>     A = integral of (1 - t) p dt,     B = integral of t p dt,     t = 0 ... 1 along the interval,
!>
!> it is p(t) = (4A - 2B)(1 - t) + (4B - 2A) t: the work of contacts and water is exactly that of the total stress, also
!> where the water table crosses the joint.
module rockdda_interaction_water_at_start
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_contact_interval_law, only : first_place
   use rockdda_contact_intervals, only : tie_place
   use rockdda_contact_table, only : contact_table_type
   use rockdda_interaction_boundary_edges, only : next_vertex
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_water, only : water_family_type
   use rockdda_interaction_water_pressure, only : water_scratch_type
   implicit none
   private
   public :: pressure_on_contacts, pressure_on_edges

contains

   !> Water pressure on the joint at each contact: the mean of both sides that are wet, 0 where none is.
   subroutine pressure_on_contacts(water, context, table, pressure)
      class(water_family_type), intent(in) :: water
      type(step_context_type), intent(in) :: context
      type(contact_table_type), intent(in) :: table
      real(wp), allocatable, intent(out) :: pressure(:)   !! (contacts) [stress]
      integer :: first(context%blocks%n_vertices() + 1)
      real(wp) :: sides(2), place, beyond(2)
      integer :: c, from, to, side
      logical :: wet(2)
      allocate (pressure(table%n), source=0.0_wp)
      if (.not. any(water%group > 0)) return
      call sort_stretches(water, first)
      to = 0
      do while (to < table%n)
         from = to + 1
         to = from
         do while (to < table%n)
            if (.not. same_interval(table, from, to + 1)) exit
            to = to + 1
         end do
         ! ends of the interval, by its points
         place = merge(tie_place, first_place, logical(table%tied(from)))
         beyond = place/(1 - 2*place)*(table%point(:, to) - table%point(:, from))
         do c = from, to
            do side = 1, 2
               sides(side) = 0
               wet(side) = .false.
               ! a vertex against an edge: only the edge is a side
               if (side == 1 .and. table%station(c) == 0) cycle
               call pressure_on_side(water, context, merge([table%block_a(c), table%vertex(c)], &
                                                           [table%block_b(c), table%edge(c)], side == 1), first, &
                                     reshape([table%point(:, from) - beyond, table%point(:, to) + beyond, &
                                              table%point(:, c)], [2, 3]), table%station(c) > 0, sides(side), wet(side))
            end do
            if (any(wet)) pressure(c) = sum(sides, mask=wet)/count(wet)
         end do
      end do
   end subroutine pressure_on_contacts

   !> Do two rows belong to one interval?
   pure logical function same_interval(table, c, d)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: c, d
      same_interval = table%station(c) > 0 .and. table%station(d) > 0 .and. table%vertex(c) == table%vertex(d) .and. &
                      table%edge(c) == table%edge(d)
   end function same_interval

   !> Stretches are sorted by edges: those of edge k are first(k) ... first(k + 1) - 1.
   pure subroutine sort_stretches(water, first)
      class(water_family_type), intent(in) :: water
      integer, intent(out) :: first(:)    !! (nv + 1)
      integer :: i, k
      k = 0
      do i = 1, size(water%stretches)
         first(k + 1:water%stretches(i)%vertices(1)) = i
         k = max(k, water%stretches(i)%vertices(1))
      end do
      first(k + 1:) = size(water%stretches) + 1
   end subroutine sort_stretches

   !> Linear pressure on one side of a contact. The interval is that between two points; for a vertex against an edge
   !> the stretch on which it stands.
   subroutine pressure_on_side(water, context, side, first, points, is_interval, pressure, wet)
      class(water_family_type), intent(in) :: water
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: side(2)                !! block and first vertex of the edge
      integer, intent(in) :: first(:)
      real(wp), intent(in) :: points(2, 3)          !! ends of the interval, and the contact
      logical, intent(in) :: is_interval
      real(wp), intent(out) :: pressure             !! at the contact [stress]
      logical, intent(out) :: wet
      type(water_scratch_type) :: scratch
      real(wp) :: p(2), q(2), s(3), ends(2), part(2), shares(2), more(2), a, b, t
      integer :: i
      pressure = 0
      wet = .false.
      p = context%blocks%vertices(:, side(2))
      q = context%blocks%vertices(:, next_vertex(context%blocks, side(1), side(2)))
      s = matmul(q - p, points - spread(p, 2, 3))/dot_product(q - p, q - p)
      ends = [minval(s), maxval(s)]
      shares = 0
      do i = first(side(2)), first(side(2) + 1) - 1
         if (water%group(i) == 0) cycle
         associate (stretch => water%stretches(i))
            if (.not. is_interval) then
               if (s(3) < stretch%ends(1) .or. s(3) > stretch%ends(2)) cycle
               ends = stretch%ends
               shares = 0
            end if
            part = [max(ends(1), stretch%ends(1)), min(ends(2), stretch%ends(2))]
         end associate
         if (.not. part(2) > part(1)) cycle
         wet = .true.
         call water%pressure(water%group(i))%end_shares(p + context%state%datum, q + context%state%datum, part, &
                                                        water%rise(context%parameters, i), scratch, more)
         shares = shares + more
      end do
      if (.not. any(shares > 0)) return
      associate (width => ends(2) - ends(1))
         b = (shares(2) - ends(1)*sum(shares))/width**2
         a = sum(shares)/width - b
         t = (s(3) - ends(1))/width
      end associate
      pressure = (4*a - 2*b)*(1 - t) + (4*b - 2*a)*t
   end subroutine pressure_on_side

   !> Integrals of (1 - s) p and s p over the edge that starts at each vertex.
   subroutine pressure_on_edges(water, blocks, parameters, shares)
      class(water_family_type), intent(in) :: water
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      real(wp), allocatable, intent(out) :: shares(:, :)   !! (2, nv) [stress]
      type(water_scratch_type) :: scratch
      real(wp) :: more(2)
      integer :: i
      allocate (shares(2, blocks%n_vertices()), source=0.0_wp)
      do i = 1, size(water%stretches)
         if (water%group(i) == 0) cycle
         associate (s => water%stretches(i), k => water%stretches(i)%vertices(1))
            call water%pressure(water%group(i))%end_shares(blocks%vertices(:, k), blocks%vertices(:, s%vertices(2)), &
                                                           s%ends, water%rise(parameters, i), scratch, more)
            shares(:, k) = shares(:, k) + more
         end associate
      end do
   end subroutine pressure_on_edges

end module rockdda_interaction_water_at_start
