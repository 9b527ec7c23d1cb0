! SPDX-License-Identifier: MIT
!> Reader of block files of DDA for Windows. They have six decimals only: prefer to
!> cut the geometry again.
!>
!>     nBlocks nBolts nRows
!>     nFixed nLoading nMeasured
!>     material first last                     for each block; rows first … last are its vertices
!>     jointMaterial x y                       for each row; the four rows after `last` are not vertices
!>     x1 y1 x2 y2 block1 block2 stiffness t0 f0    for each bolt, on three lines
!>     type x y block                          for each point; type 0 fixed, 2 loading, 1 measured
module rockdda_io_peer_block_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_io_counting, only : plain_numbers
   use rockdda_io_numbers, only : is_whole
   use rockdda_io_record_reader, only : record_reader_type
   use rockdda_io_tokens, only : token_list_type
   implicit none
   private
   public :: fits_peer_blocks, read_peer_blocks

contains

   !> Do the six counts at the beginning fit the numbers of the file?
   pure logical function fits_peer_blocks(tokens)
      type(token_list_type), intent(in) :: tokens
      real(wp), allocatable :: values(:)
      integer(i8) :: n(6)
      integer :: k
      fits_peer_blocks = .false.
      if (tokens%n_numbers < 6 + 3 + 21) return
      values = plain_numbers(tokens)
      do k = 1, 6
         if (.not. is_whole(values(k)) .or. values(k) < 0) return
      end do
      n = nint(values(1:6), i8)
      if (n(1) < 1 .or. n(3) < 3) return
      fits_peer_blocks = 6 + 3*n(1) + 3*n(3) + 9*n(2) + 4*(n(4) + n(5) + n(6)) == tokens%n_numbers
   end function fits_peer_blocks

   !> Read a block file of DDA for Windows.
   subroutine read_peer_blocks(tokens, blocks, block_token, edge_token, messages)
      type(token_list_type), intent(in) :: tokens       !! fits_peer_blocks holds
      type(block_system_type), intent(inout) :: blocks
      integer, allocatable, intent(out) :: block_token(:) !! (n_blocks) token where each begins
      integer, allocatable, intent(out) :: edge_token(:)  !! (n_vertices) token where the row of each edge begins
      type(diagnostics_type), intent(inout) :: messages
      type(record_reader_type) :: reader
      integer, allocatable :: range(:, :), row_joint(:), row_token(:)
      real(wp), allocatable :: rows(:, :)
      integer :: n(6), i, n_rows, n_errors, point_block

      n_errors = messages%n_errors
      do i = 1, 6
         call reader%read_count(tokens, 'count', n(i), messages)
      end do
      n_rows = n(3)
      blocks%n_blocks = n(1)
      allocate (blocks%vertex_offset(n(1) + 1), blocks%block_material(n(1)), block_token(n(1)), row_joint(n_rows), &
                row_token(n_rows), source=0)
      allocate (range(2, n(1)), rows(2, n_rows))
      do i = 1, n(1)
         call reader%read_record(tokens, [character(len=12) :: 'material', 'first vertex', 'last vertex'], 'block', i, &
                                 messages)
         block_token(i) = reader%record%first_token
         blocks%block_material(i) = reader%to_whole(tokens, 1, 'material', 'block', i, messages)
         range(1, i) = reader%to_whole(tokens, 2, 'first vertex', 'block', i, messages)
         range(2, i) = reader%to_whole(tokens, 3, 'last vertex', 'block', i, messages)
         call reader%require(tokens, range(2, i) <= n_rows .and. range(2, i) >= range(1, i) + 2, 3, 'last vertex', &
                             'block', i, 'must be at least 2 more than the first and at most '//to_string(n_rows), &
                             messages)
      end do
      do i = 1, n_rows
         call reader%read_record(tokens, [character(len=14) :: 'joint material', 'x', 'y'], 'row', i, messages)
         row_token(i) = reader%record%first_token
         rows(:, i) = reader%record%value(2:3)
         row_joint(i) = int(max(-1.0_wp, min(1.0e9_wp, reader%record%value(1))))
      end do
      if (messages%n_errors > n_errors) return
      call take_polygons()
      call read_bolts(n(2))
      call read_points(n(4:6))
      call messages%add(severity%note, 'block file of DDA for Windows: six decimals only, no e0', &
                        tokens%source%file_origin())

   contains

      !> The rows of each block as its polygon, counter-clockwise.
      subroutine take_polygons()
         integer :: b, first, last, m, k, from
         do b = 1, blocks%n_blocks
            blocks%vertex_offset(b + 1) = blocks%vertex_offset(b) + range(2, b) - range(1, b) + 1
         end do
         allocate (blocks%vertices(2, blocks%n_vertices()), blocks%edge_joint(blocks%n_vertices()), &
                   edge_token(blocks%n_vertices()))
         do b = 1, blocks%n_blocks
            first = blocks%vertex_offset(b)
            m = blocks%vertex_offset(b + 1) - first
            last = range(2, b)
            do k = 1, m
               from = range(1, b) + k - 1
               blocks%vertices(:, first + k) = rows(:, from)
               blocks%edge_joint(first + k) = row_joint(from)
               edge_token(first + k) = row_token(from)
            end do
            if (polygon_area(blocks%vertices(:, first + 1:first + m)) >= 0) cycle
            ! clockwise: reverse; edge k of the reversed polygon is edge m - k of the old one
            do k = 1, m
               blocks%vertices(:, first + k) = rows(:, last - k + 1)
               from = merge(last, last - k, k == m)
               blocks%edge_joint(first + k) = row_joint(from)
               edge_token(first + k) = row_token(from)
            end do
         end do
      end subroutine take_polygons

      !> Bolts: t0 is read as strength, f0 as pretension.
      subroutine read_bolts(n_bolts)
         integer, intent(in) :: n_bolts
         integer :: k
         associate (bolts => blocks%bolts)
            bolts%n = n_bolts
            allocate (bolts%ends(4, n_bolts), bolts%blocks(2, n_bolts), bolts%stiffness(n_bolts), &
                      bolts%pretension(n_bolts), bolts%strength(n_bolts))
            do k = 1, n_bolts
               call reader%read_record(tokens, [character(len=9) :: 'x1', 'y1', 'x2', 'y2', 'block 1', 'block 2', &
                                                'stiffness', 't0', 'f0'], 'bolt', k, messages)
               bolts%ends(:, k) = reader%record%value(1:4)
               bolts%blocks(1, k) = reader%to_whole(tokens, 5, 'block 1', 'bolt', k, messages)
               bolts%blocks(2, k) = reader%to_whole(tokens, 6, 'block 2', 'bolt', k, messages)
               bolts%stiffness(k) = reader%record%value(7)
               bolts%strength(k) = reader%record%value(8)
               bolts%pretension(k) = reader%record%value(9)
               call reader%require(tokens, all(bolts%blocks(:, k) <= blocks%n_blocks), 5, 'blocks', 'bolt', k, &
                                   'must not be larger than '//to_string(blocks%n_blocks), messages)
               call reader%require(tokens, bolts%stiffness(k) > 0, 7, 'stiffness', 'bolt', k, &
                                   'must be greater than 0', messages)
               call reader%require(tokens, bolts%strength(k) >= 0, 8, 't0', 'bolt', k, 'must not be negative', messages)
            end do
            if (n_bolts > 0) call messages%add(severity%warning, &
               'bolts: t0 is read as strength, f0 as pretension', tokens%source%file_origin())
         end associate
      end subroutine read_bolts

      !> Points of all three kinds, distinguished by their type.
      subroutine read_points(counts)
         integer, intent(in) :: counts(3)    !! fixed, loading, measured
         integer :: k, kind
         call allocate_points(blocks%fixed, counts(1))
         call allocate_points(blocks%loading, counts(2))
         call allocate_points(blocks%measured, counts(3))
         do k = 1, sum(counts)
            call reader%read_record(tokens, [character(len=5) :: 'type', 'x', 'y', 'block'], 'point', k, messages)
            point_block = reader%to_whole(tokens, 4, 'block', 'point', k, messages)
            kind = -1
            if (is_whole(reader%record%value(1))) kind = nint(reader%record%value(1))
            select case (kind)
            case (0); call add_point(blocks%fixed)
            case (2); call add_point(blocks%loading)
            case (1); call add_point(blocks%measured)
            case default
               call reader%require(tokens, .false., 1, 'type', 'point', k, &
                                   'must be 0 (fixed), 1 (measured) or 2 (loading)', messages)
            end select
         end do
         if (messages%n_errors == n_errors .and. any([blocks%fixed%n, blocks%loading%n, blocks%measured%n] /= counts)) &
            call messages%add(severity%error, 'the types of the points do not agree with the counts of fixed, '// &
                              'loading and measured points', tokens%source%file_origin())
         call trim_points(blocks%fixed)
         call trim_points(blocks%loading)
         call trim_points(blocks%measured)
      end subroutine read_points

      !> Allocate all points of the file; n counts those read.
      subroutine allocate_points(points, expected)
         type(point_set_type), intent(inout) :: points
         integer, intent(in) :: expected
         points%n = 0
         allocate (points%position(2, expected), points%block(expected), points%origin(expected))
      end subroutine allocate_points

      !> Store the point of the last record.
      subroutine add_point(points)
         type(point_set_type), intent(inout) :: points
         points%n = points%n + 1
         if (points%n > size(points%block)) return
         points%position(:, points%n) = reader%record%value(2:3)
         points%block(points%n) = point_block
         points%origin(points%n) = reader%record_origin(tokens)
      end subroutine add_point

      !> Limit the points to the announced number (reported above).
      subroutine trim_points(points)
         type(point_set_type), intent(inout) :: points
         points%n = min(points%n, size(points%block))
      end subroutine trim_points

   end subroutine read_peer_blocks

end module rockdda_io_peer_block_file
