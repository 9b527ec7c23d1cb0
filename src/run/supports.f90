! SPDX-License-Identifier: MIT
!> What linings and bolts bear in the present state of a run: a line for each lining and each group of bolts.
module rockdda_run_supports
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : counted, to_string
   use rockdda_model_state, only : bolt_nodes_type, liner_nodes_type
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: lining_summary_type, bolt_summary_type, summarise_linings, summarise_bolts, supports_text

   !> One lining that is there.
   type :: lining_summary_type
      character(len=:), allocatable :: name
      real(wp) :: least(3) = 0, most(3) = 0      !! N (tension positive) [force/length], M [force], Q [force/length]
      integer :: n = 0                           !! nodes
      integer :: n_cracked = 0, n_crushed = 0
      real(wp) :: opening = 0, slip = 0          !! of its back, the largest [length]
   end type lining_summary_type

   !> The bolts of a group, or all springs.
   type :: bolt_summary_type
      character(len=:), allocatable :: name
      integer :: n = 0                           !! bolts that are there
      real(wp) :: force = 0                      !! largest, per bolt [force]
      real(wp) :: use = 0                        !! largest share of a strength, 0: none is given
      integer :: n_slipping = 0, n_yielding = 0, n_ruptured = 0   !! bolts with such a node
      integer :: n_pushed = 0                    !! bolts that bear compression, by their largest force
      real(wp) :: pushed = 0                     !! the largest of these [force]
   end type bolt_summary_type

contains

   !> Linings that are there.
   subroutine summarise_linings(sim, linings)
      type(simulation_type), intent(in) :: sim
      type(lining_summary_type), allocatable, intent(out) :: linings(:)
      type(liner_nodes_type) :: nodes
      type(lining_summary_type) :: one
      integer, allocatable :: there(:)
      integer :: i, k, last, n
      allocate (linings(0))
      if (sim%families%liners%n_nodes() == 0) return
      call sim%show_liners(nodes)
      last = 0
      do k = 1, size(sim%families%liners%liners)
         associate (liner => sim%families%liners%liners(k))
            n = liner%layout%n
            there = pack([(i, i=last + 1, last + n)], nodes%state(last + 1:last + n) > 0)
            last = last + n
            if (size(there) == 0) cycle
            one%name = liner%name
            ! N and Q on both sides of a corner
            one%least = [minval(nodes%sides([1, 3], there)), minval(nodes%force(2, there)), &
                         minval(nodes%sides([2, 4], there))]
            one%most = [maxval(nodes%sides([1, 3], there)), maxval(nodes%force(2, there)), &
                        maxval(nodes%sides([2, 4], there))]
            one%n = size(there)
            one%n_cracked = count(nodes%state(there) == 2)
            one%n_crushed = count(nodes%state(there) == 3)
            one%opening = maxval(nodes%back(1, there))
            one%slip = maxval(nodes%back(2, there))
            linings = [linings, one]
         end associate
      end do
   end subroutine summarise_linings

   !> Bolts by group; springs together.
   subroutine summarise_bolts(sim, groups)
      type(simulation_type), intent(in) :: sim
      type(bolt_summary_type), allocatable, intent(out) :: groups(:)
      type(bolt_nodes_type) :: nodes
      type(bolt_summary_type) :: group
      character(len=:), allocatable :: name
      integer :: first, g, k, last, l
      allocate (groups(0))
      call sim%show_bolts(nodes)
      last = sim%blocks%bolts%n
      if (last > 0) then
         group = bolt_summary_type('springs', last, maxval(abs(nodes%force(:last))))
         if (allocated(nodes%use)) group%use = maxval(nodes%use(:last))
         group%n_pushed = count(nodes%force(:last) < 0)
         group%pushed = max(0.0_wp, -minval(nodes%force(:last)))
         groups = [groups, group]
      end if
      if (sim%families%bars%n_nodes() == 0) return
      do l = 1, size(sim%families%bars%bolts)
         associate (bolt => sim%families%bars%bolts(l))
            first = last + 1
            last = last + bolt%bar%n
            if (.not. any(nodes%state(first:last) > 0)) cycle
            name = bolt%name(:max(1, verify(bolt%name, '0123456789', back=.true.)))
            g = 0
            do k = 1, size(groups)
               if (groups(k)%name == trim(name)) g = k
            end do
            if (g == 0) then
               group = bolt_summary_type(trim(name))
               groups = [groups, group]
               g = size(groups)
            end if
            groups(g)%n = groups(g)%n + 1
            groups(g)%force = max(groups(g)%force, maxval(abs(nodes%force(first:last))))
            groups(g)%use = max(groups(g)%use, maxval(nodes%use(first:last)))
            associate (least => minval(nodes%force(first:last)), most => maxval(nodes%force(first:last)))
               if (least < 0 .and. -least > most) then
                  groups(g)%n_pushed = groups(g)%n_pushed + 1
                  groups(g)%pushed = max(groups(g)%pushed, -least)
               end if
            end associate
            groups(g)%n_slipping = groups(g)%n_slipping + merge(1, 0, any(nodes%state(first:last) == 2))
            groups(g)%n_yielding = groups(g)%n_yielding + merge(1, 0, any(nodes%state(first:last) == 3))
            groups(g)%n_ruptured = groups(g)%n_ruptured + merge(1, 0, any(nodes%state(first:last) == 4))
         end associate
      end do
   end subroutine summarise_bolts

   !> A line for each lining and each group of bolts, with a prefix; '' where there is none.
   function supports_text(sim, prefix) result(text)
      type(simulation_type), intent(in) :: sim
      character(len=*), intent(in) :: prefix
      character(len=:), allocatable :: text
      type(lining_summary_type), allocatable :: linings(:)
      type(bolt_summary_type), allocatable :: bolts(:)
      integer :: k
      call summarise_linings(sim, linings)
      call summarise_bolts(sim, bolts)
      text = ''
      do k = 1, size(linings)
         associate (liner => linings(k))
            text = text//prefix//"lining '"//liner%name//"': N "//extremes(1, 'thrust')//', M '// &
                   extremes(2, 'moment')//', Q '//extremes(3, 'thrust')//'; '// &
                   to_string(liner%n_cracked)//' cracked, '// &
                   to_string(liner%n_crushed)//' crushed of '//counted(liner%n, 'node')
            if (liner%slip > 0) text = text//'; slip at its back up to '//shown(liner%slip, 'length')
            if (liner%opening > 0) text = text//'; open by up to '//shown(liner%opening, 'length')
            text = text//new_line('a')
         end associate
      end do
      do k = 1, size(bolts)
         associate (group => bolts(k))
            text = text//prefix//"bolts '"//group%name//"': "//counted(group%n, 'bolt')//', force up to '// &
                   shown(group%force, 'force')
            if (group%use > 0) text = text//', '//to_string(100*group%use, 3)//' % of the strength'
            text = text//'; '//to_string(group%n_slipping)//' slipping, '//to_string(group%n_yielding)// &
                   ' yielding, '//to_string(group%n_ruptured)//' ruptured'
            if (group%n_pushed > 0) text = text//'; '//to_string(group%n_pushed)//' in compression, up to '// &
                                           shown(group%pushed, 'force')
            text = text//new_line('a')
         end associate
      end do
      if (len(text) > 0) text = text(:len(text) - 1)

   contains

      !> Least and most of a force on the sections of lining k.
      function extremes(i, dimension)
         integer, intent(in) :: i
         character(len=*), intent(in) :: dimension
         character(len=:), allocatable :: extremes
         extremes = shown(linings(k)%least(i), dimension)//' to '//shown(linings(k)%most(i), dimension)
      end function extremes

      function shown(value, dimension)
         real(wp), intent(in) :: value
         character(len=*), intent(in) :: dimension
         character(len=:), allocatable :: shown
         shown = sim%parameters%shown(value, dimension, 3)
      end function shown

   end function supports_text

end module rockdda_run_supports
