! SPDX-License-Identifier: MIT
!> Warning of splinters: blocks far thinner than the others, as joints that nearly coincide cut them off.
module rockdda_check_splinters
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_polygons, only : inradius_bound, polygon_properties
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_units, only : unit_system_type, unit_system
   implicit none
   private
   public :: check_splinters

   !> A splinter is thinner than this share of the side of a square of the mean area.
   real(wp), parameter :: thin = 0.0025_wp
   !> Largest number of splinters named in the summary.
   integer, parameter :: most_named = 3

contains

   !> A warning for each splinter, with number, place and thickness; one for all in a run.
   subroutine check_splinters(blocks, units, messages)
      type(block_system_type), intent(in) :: blocks
      character(len=*), intent(in) :: units                !! name of the system
      type(diagnostics_type), intent(inout) :: messages
      type(origin_type) :: origin
      real(wp) :: area(blocks%n_blocks), thickness(blocks%n_blocks), centroid(2, blocks%n_blocks), moments(3)
      character(len=:), allocatable :: text
      integer, allocatable :: splinters(:)
      integer :: i, k, summary
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            call polygon_properties(v, area(i), centroid(:, i), moments)
            thickness(i) = inradius_bound(v)      ! of a strip
         end associate
      end do
      splinters = pack([(i, i=1, blocks%n_blocks)], thickness < thin*sqrt(sum(area)/blocks%n_blocks))
      if (size(splinters) == 0) return
      summary = 0
      if (size(splinters) > 1) then
         text = to_string(size(splinters))//' blocks are splinters: '//described(splinters(1))
         do k = 2, min(most_named, size(splinters))
            text = text//', '//described(splinters(k))
         end do
         if (size(splinters) > most_named) text = text//" …; 'rockdda check' lists all"
         call messages%add_summary(severity%warning, size(splinters), text, origin, summary)
      end if
      do k = 1, size(splinters)
         call messages%add(severity%warning, 'block '//described(splinters(k))//': a splinter between joints that '// &
                           'nearly coincide; move one of them onto the other, or raise the edge-node distance e0', &
                           origin, summary)
      end do

   contains

      !> "7 at (1.5, 2) is 0.003 thick".
      function described(i) result(words)
         integer, intent(in) :: i
         character(len=:), allocatable :: words
         type(unit_system_type) :: u
         u = unit_system(units)
         words = to_string(i)//' at ('//to_string(centroid(1, i), 5)//', '//to_string(centroid(2, i), 5)//') is '// &
                 u%shown(thickness(i), 'length', 2)//' thick'
      end function described

   end subroutine check_splinters

end module rockdda_check_splinters
