! SPDX-License-Identifier: MIT
!> Check blocks and points of a block file. Used by all readers of block files.
module rockdda_io_block_check
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_geometry_bridges, only : match_bridges
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_geometry_simplicity, only : find_crossing
   use rockdda_model_blocks, only : block_system_type, point_set_type, largest_coordinate
   use rockdda_io_overlap_check, only : check_overlaps
   use rockdda_io_record_reader, only : smallest_length
   use rockdda_io_tokens, only : token_list_type
   implicit none
   private
   public :: check_blocks

   !> Edges that cross by less than this share of the block size count as contact: files may have six digits.
   real(wp), parameter :: few_digits = 1.0e-5_wp

contains

   !> Check that polygons have three vertices or more and run counter-clockwise around an area without crossing
   !> themselves, and that every number is in range.
   subroutine check_blocks(blocks, tokens, block_token, edge_token, messages)
      type(block_system_type), intent(in) :: blocks
      type(token_list_type), intent(in) :: tokens
      integer, intent(in) :: block_token(:)     !! (n_blocks) token where each block begins
      integer, intent(in) :: edge_token(:)      !! (n_vertices) token where the row of each edge begins
      type(diagnostics_type), intent(inout) :: messages
      integer :: i, first, last, one, other, n_errors
      real(wp) :: area, tolerance
      n_errors = messages%n_errors
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         if (last - first < 2) then
            call report('needs at least 3 vertices, has '//to_string(last - first + 1))
         else if (any(.not. abs(blocks%vertices(:, first:last)) <= largest_coordinate)) then
            call report('a coordinate is larger than '//to_string(largest_coordinate))
         else
            area = polygon_area(blocks%vertices(:, first:last))
            tolerance = max(blocks%edge_node_distance, few_digits*sqrt(abs(area)))
            call find_crossing(blocks%vertices(:, first:last), tolerance, one, other)
            if (.not. area > 0) then
               call report('its vertices must run counter-clockwise around an area greater than 0, found area '// &
                           to_string(area))
            else if (area < 0.01_wp*smallest_length**2) then
               call report('its area is too small to compute with: '//to_string(area))
            else if (one > 0) then
               call report('its edges '//to_string(one)//' and '//to_string(other)//' cross')
            end if
         end if
         if (blocks%block_material(i) < 1) call report('material must be at least 1, found '// &
                                                       to_string(blocks%block_material(i)))
         if (any(blocks%edge_joint(first:last) < 0)) call report('a joint material is negative')
         if (any(blocks%edge_joint(first:last) == 0)) call check_bridges()
      end do
      if (messages%n_errors == n_errors) call check_overlaps(blocks, tokens, block_token, messages)
      call check_points('fixed point', blocks%fixed)
      call check_points('loading point', blocks%loading)
      call check_points('measured point', blocks%measured)

   contains

      !> Report an error of block i.
      subroutine report(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, 'block '//to_string(i)//': '//text, tokens%origin(block_token(i)))
      end subroutine report

      !> Check that each bridge edge of block i is walked in both directions.
      subroutine check_bridges()
         integer, allocatable :: twin(:)
         integer :: k
         allocate (twin, source=match_bridges(blocks%vertices(:, first:last), blocks%edge_joint(first:last) == 0))
         do k = 1, size(twin)
            if (twin(k) > 0 .or. blocks%edge_joint(first + k - 1) /= 0) cycle
            call messages%add(severity%error, 'block '//to_string(i)// &
               ': joint material 0 marks a bridge to an island, '// &
                              'but no other edge of joint material 0 leads from the end of edge '//to_string(k)// &
                              ' back to its start', tokens%origin(edge_token(first + k - 1)))
         end do
      end subroutine check_bridges

      !> Check that points lie on blocks that exist.
      subroutine check_points(name, points)
         character(len=*), intent(in) :: name
         type(point_set_type), intent(in) :: points
         type(origin_type) :: origin
         integer :: k
         do k = 1, points%n
            origin = points%origin(k)
            if (points%block(k) < 1 .or. points%block(k) > blocks%n_blocks) call messages%add(severity%error, &
               name//' '//to_string(k)//': its block must be between 1 and '//to_string(blocks%n_blocks)//', found '// &
               to_string(points%block(k)), origin)
            if (any(.not. abs(points%position(:, k)) <= largest_coordinate)) call messages%add(severity%error, &
               name//' '//to_string(k)//': a coordinate is larger than '//to_string(largest_coordinate), origin)
         end do
      end subroutine check_points

   end subroutine check_blocks

end module rockdda_io_block_check
