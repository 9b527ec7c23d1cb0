! SPDX-License-Identifier: MIT
!> Outline of an opening that a &region of an options file draws.
module rockdda_io_region_outline
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_lines_statistics, only : opening_type, shape_kind
   use rockdda_io_namelist_parser, only : namelist_type, group_type, parse_namelist, find_entry
   use rockdda_io_option_values, only : get_text, get_reals
   use rockdda_io_source, only : source_type, read_source
   implicit none
   private
   public :: read_region_outline

contains

   !> Set the shape of an opening to that of the region of a name: one polygon, box or circle.
   subroutine read_region_outline(path, wanted, opening, messages)
      character(len=*), intent(in) :: path     !! of the options file
      character(len=*), intent(in) :: wanted
      type(opening_type), intent(inout) :: opening
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      type(namelist_type) :: namelist
      type(diagnostics_type) :: reported_there   !! faults of the options file are reported where it is read
      character(len=:), allocatable :: name, known
      integer :: i, found, n_found
      logical :: ok
      call read_source(path, source, messages, ok)
      if (.not. ok) return
      call parse_namelist(source, namelist, reported_there)
      known = ''
      n_found = 0
      found = 0
      do i = 1, namelist%n
         associate (group => namelist%groups(i))
            if (group%name /= 'region' .or. find_entry(group, 'name') == 0) cycle
            call get_text(namelist, group%entries(find_entry(group, 'name')), name, reported_there)
            if (.not. allocated(name)) cycle
            if (len(known) > 0) known = known//', '
            known = known//"'"//trim(adjustl(name))//"'"
            if (lower_case(trim(adjustl(name))) /= lower_case(trim(adjustl(wanted)))) cycle
            n_found = n_found + 1
            found = i
         end associate
      end do
      if (n_found == 1) then
         call set_outline(namelist, namelist%groups(found), opening, ok)
         if (.not. ok) call report("the region '"//trim(wanted)//"' of "//path// &
                                   ' is not drawn by one polygon, one box or one circle')
      else if (n_found > 1) then
         call report(to_string(n_found)//" groups of &region '"//trim(wanted)//"' in "//path// &
                     ': expected one, with a polygon, a box or a circle')
      else if (len(known) > 0) then
         call report("no &region '"//trim(wanted)//"' in "//path//': its regions are '//known)
      else
         call report("no &region '"//trim(wanted)//"' in "//path//', which has no regions')
      end if

   contains

      !> Report a fault of the reference.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&opening: outline: '//text, opening%origin)
      end subroutine report

   end subroutine read_region_outline

   !> Set the shape to the polygon, box or circle of a region.
   subroutine set_outline(namelist, group, opening, ok)
      type(namelist_type), intent(in) :: namelist
      type(group_type), intent(in) :: group
      type(opening_type), intent(inout) :: opening
      logical, intent(out) :: ok
      type(diagnostics_type) :: reported_there
      real(wp), allocatable :: box(:), circle(:), polygon(:)
      integer :: i
      ok = .true.
      do i = 1, group%n
         select case (group%entries(i)%name)
         case ('name')
         case ('box'); call get_reals(namelist, group%entries(i), 4, .false., box, reported_there)
         case ('circle'); call get_reals(namelist, group%entries(i), 3, .false., circle, reported_there)
         case ('polygon'); call get_reals(namelist, group%entries(i), 2, .true., polygon, reported_there)
         case default; ok = .false.
         end select
      end do
      ok = ok .and. .not. reported_there%has_errors() .and. &
           count([allocated(box), allocated(circle), allocated(polygon)]) == 1
      if (.not. ok) return
      opening%center = 0
      opening%shape = shape_kind%polygon
      if (allocated(box)) then
         opening%vertices = reshape([box(1), box(2), box(3), box(2), box(3), box(4), box(1), box(4)], [2, 4])
      else if (allocated(circle)) then
         opening%shape = shape_kind%circle
         opening%center = circle(1:2)
         opening%radius = circle(3)
      else
         opening%vertices = reshape(polygon, [2, size(polygon)/2])
      end if
      if (allocated(circle)) ok = opening%radius > 0
   end subroutine set_outline

end module rockdda_io_region_outline
