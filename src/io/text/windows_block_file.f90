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
module rockdda_io_windows_block_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : to_string
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_model_blocks, only : block_system_type, bolt_set_type, point_set_type
   use rockdda_io_counting, only : plain_numbers
   use rockdda_base_numbers, only : is_whole
   use rockdda_io_record_reader, only : record_reader_type
   use rockdda_io_tokens, only : token_list_type
   implicit none
   private
   public :: fits_windows_blocks, read_windows_blocks

   character(len=*), parameter :: block_names(3) = [character(len=12) :: 'material', 'first vertex', 'last vertex']
   character(len=*), parameter :: row_names(3) = [character(len=14) :: 'joint material', 'x', 'y']
   character(len=*), parameter :: bolt_names(9) = [character(len=9) :: 'x1', 'y1', 'x2', 'y2', 'block 1', 'block 2', &
                                                   'stiffness', 't0', 'f0']
   character(len=*), parameter :: point_names(4) = [character(len=5) :: 'type', 'x', 'y', 'block']

   !> The rows of the file, of which blocks take some as their vertices.
   type :: rows_type
      real(wp), allocatable :: position(:, :)   !! (2, n)
      integer, allocatable :: joint(:)          !! (n) joint material
      integer, allocatable :: token(:)          !! (n) first token
   end type rows_type

contains

   !> Do the six counts at the beginning fit the numbers of the file?
   pure logical function fits_windows_blocks(tokens)
      type(token_list_type), intent(in) :: tokens
      real(wp), allocatable :: values(:)
      integer(i8) :: n(6)
      integer :: k
      fits_windows_blocks = .false.
      if (tokens%n_numbers < 6 + 3 + 21) return
      values = plain_numbers(tokens)
      do k = 1, 6
         if (.not. is_whole(values(k)) .or. values(k) < 0) return
      end do
      n = nint(values(1:6), i8)
      if (n(1) < 1 .or. n(3) < 3) return
      fits_windows_blocks = 6 + 3*n(1) + 3*n(3) + 9*n(2) + 4*(n(4) + n(5) + n(6)) == tokens%n_numbers
   end function fits_windows_blocks

   !> Read a block file of DDA for Windows.
   subroutine read_windows_blocks(tokens, blocks, block_token, edge_token, messages)
      type(token_list_type), intent(in), target :: tokens   !! fits_windows_blocks holds
      type(block_system_type), intent(inout) :: blocks
      integer, allocatable, intent(out) :: block_token(:) !! (n_blocks) token where each begins
      integer, allocatable, intent(out) :: edge_token(:)  !! (n_vertices) token where the row of each edge begins
      type(diagnostics_type), intent(inout) :: messages
      type(record_reader_type) :: reader
      type(rows_type) :: rows
      integer, allocatable :: range(:, :)
      integer :: n(6), i

      reader%tokens => tokens
      do i = 1, 6
         call reader%read_count('count', n(i))
      end do
      blocks%n_blocks = n(1)
      allocate (blocks%block_material(n(1)), block_token(n(1)), range(2, n(1)))
      do i = 1, n(1)
         call reader%read_record(block_names, 'block', i)
         block_token(i) = reader%record%first_token
         blocks%block_material(i) = reader%to_whole(1)
         range(1, i) = reader%to_whole(2)
         range(2, i) = reader%to_whole(3)
         call reader%require(range(2, i) <= n(3) .and. range(2, i) >= range(1, i) + 2, 3, &
                             'must be at least 2 more than the first and at most '//to_string(n(3)))
      end do
      allocate (rows%position(2, n(3)), rows%joint(n(3)), rows%token(n(3)))
      do i = 1, n(3)
         call reader%read_record(row_names, 'row', i)
         rows%token(i) = reader%record%first_token
         rows%position(:, i) = reader%record%value(2:3)
         rows%joint(i) = int(max(-1.0_wp, min(1.0e9_wp, reader%record%value(1))))
      end do
      if (.not. reader%messages%has_errors()) then
         call take_polygons(rows, range, blocks, edge_token)
         call read_bolts(reader, n(2), blocks%n_blocks, blocks%bolts)
         call read_points(reader, n(4:6), blocks)
         call reader%messages%add(severity%note, 'block file of DDA for Windows: six decimals only, no e0', &
                                  tokens%source%file_origin())
      end if
      call messages%append(reader%messages)
   end subroutine read_windows_blocks

   !> Take the rows of each block as its polygon, counter-clockwise.
   subroutine take_polygons(rows, range, blocks, edge_token)
      type(rows_type), intent(in) :: rows
      integer, intent(in) :: range(:, :)                 !! (2, n_blocks) first and last row of each
      type(block_system_type), intent(inout) :: blocks
      integer, allocatable, intent(out) :: edge_token(:)
      integer :: b, first, last, m, k, n
      integer, allocatable :: from(:), edge(:)           ! row of each vertex, and of the edge that starts there
      allocate (blocks%vertex_offset(blocks%n_blocks + 1), source=0)
      do b = 1, blocks%n_blocks
         blocks%vertex_offset(b + 1) = blocks%vertex_offset(b) + range(2, b) - range(1, b) + 1
      end do
      n = blocks%n_vertices()
      allocate (from(n), edge(n))
      do b = 1, blocks%n_blocks
         first = blocks%vertex_offset(b)
         m = blocks%vertex_offset(b + 1) - first
         last = range(2, b)
         from(first + 1:first + m) = [(range(1, b) + k - 1, k=1, m)]
         edge(first + 1:first + m) = from(first + 1:first + m)
         if (polygon_area(rows%position(:, range(1, b):last)) >= 0) cycle
         ! clockwise: reverse; edge k of the reversed polygon is edge m - k of the old one
         from(first + 1:first + m) = [(last - k + 1, k=1, m)]
         edge(first + 1:first + m) = [(last - k, k=1, m - 1), last]
      end do
      blocks%vertices = rows%position(:, from)
      blocks%edge_joint = rows%joint(edge)
      edge_token = rows%token(edge)
   end subroutine take_polygons

   !> Read bolts: t0 is taken as strength, f0 as pretension.
   subroutine read_bolts(reader, n, n_blocks, bolts)
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: n, n_blocks
      type(bolt_set_type), intent(inout) :: bolts
      integer :: k
      bolts%n = n
      allocate (bolts%ends(4, n), bolts%blocks(2, n), bolts%stiffness(n), bolts%pretension(n), bolts%strength(n))
      do k = 1, n
         call reader%read_record(bolt_names, 'bolt', k)
         bolts%ends(:, k) = reader%record%value(1:4)
         bolts%blocks(1, k) = reader%to_whole(5)
         bolts%blocks(2, k) = reader%to_whole(6)
         bolts%stiffness(k) = reader%record%value(7)
         bolts%strength(k) = reader%record%value(8)
         bolts%pretension(k) = reader%record%value(9)
         call reader%require(bolts%blocks(1, k) <= n_blocks, 5, 'must not be larger than '//to_string(n_blocks))
         call reader%require(bolts%blocks(2, k) <= n_blocks, 6, 'must not be larger than '//to_string(n_blocks))
         call reader%require(bolts%stiffness(k) > 0, 7, 'must be greater than 0')
         call reader%require(bolts%strength(k) >= 0, 8, 'must not be negative')
      end do
      if (n > 0) call reader%messages%add(severity%warning, 'bolts: t0 is read as strength, f0 as pretension', &
                                   reader%tokens%source%file_origin())
   end subroutine read_bolts

   !> Read points of all three kinds, distinguished by their type.
   subroutine read_points(reader, counts, blocks)
      type(record_reader_type), intent(inout) :: reader
      integer, intent(in) :: counts(3)                   !! fixed, loading, measured
      type(block_system_type), intent(inout) :: blocks
      integer :: k, kind, block
      call allocate_points(blocks%fixed, counts(1))
      call allocate_points(blocks%loading, counts(2))
      call allocate_points(blocks%measured, counts(3))
      do k = 1, sum(counts)
         call reader%read_record(point_names, 'point', k)
         block = reader%to_whole(4)
         kind = -1
         if (is_whole(reader%record%value(1))) kind = nint(reader%record%value(1))
         associate (position => reader%record%value(2:3))
            select case (kind)
            case (0); call add_point(blocks%fixed, position, block, reader%record_origin())
            case (2); call add_point(blocks%loading, position, block, reader%record_origin())
            case (1); call add_point(blocks%measured, position, block, reader%record_origin())
            case default
               call reader%require(.false., 1, 'must be 0 (fixed), 1 (measured) or 2 (loading)')
            end select
         end associate
      end do
      if (.not. reader%messages%has_errors() .and. any([blocks%fixed%n, blocks%loading%n, &
         blocks%measured%n] /= counts)) call reader%messages%add(severity%error, &
         'the types of the points do not agree with the counts of fixed, loading and measured points', &
         reader%tokens%source%file_origin())
      blocks%fixed%n = min(blocks%fixed%n, counts(1))
      blocks%loading%n = min(blocks%loading%n, counts(2))
      blocks%measured%n = min(blocks%measured%n, counts(3))
   end subroutine read_points

   !> Allocate all points of the file; n counts those read.
   subroutine allocate_points(points, expected)
      type(point_set_type), intent(inout) :: points
      integer, intent(in) :: expected
      points%n = 0
      allocate (points%position(2, expected), points%block(expected), points%origin(expected))
   end subroutine allocate_points

   !> Count a point, and store it if it is not one too many.
   subroutine add_point(points, position, block, origin)
      type(point_set_type), intent(inout) :: points
      real(wp), intent(in) :: position(2)
      integer, intent(in) :: block
      type(origin_type), intent(in) :: origin
      points%n = points%n + 1
      if (points%n > size(points%block)) return
      points%position(:, points%n) = position
      points%block(points%n) = block
      points%origin(points%n) = origin
   end subroutine add_point

end module rockdda_io_windows_block_file
