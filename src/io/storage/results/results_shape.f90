! SPDX-License-Identifier: MIT
!> Do the arrays of a results file fit each other? Names, types and shapes of all tables, and the numbers by which
!> others are found: offsets of vertices and contacts, blocks of points. The rows of history and frames are not read.
!>
!> The Python package has the same rules and messages (postprocess/rockdda/storage/check.py).
module rockdda_io_results_shape
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_results_header, only : n_tables
   use rockdda_io_results_tables, only : tables, per, n_sizes, row_shape
   use rockdda_base_value_check, only : value_check_type
   implicit none
   private
   public :: check_results_shape

   !> Types of the values of a table.
   logical, parameter :: reals = .true., integers = .false.

contains

   !> Check the shapes of all datasets; the error (code input) is "FILE: error: the file is damaged: …".
   subroutine check_results_shape(file, error)
      type(hdf5_file_type), intent(in) :: file
      type(error_type), allocatable, intent(out) :: error
      type(value_check_type) :: check
      integer :: nb, nv, n_linings, points(3), sizes(n_sizes)
      call check_model(file, check, nb, nv, points)
      sizes = 0
      sizes(-per%block) = nb
      sizes(-per%vertex) = nv
      sizes(-per%fixed) = points(1)
      sizes(-per%measured) = points(3)
      call check_bolts(file, check, nb, sizes(-per%bolt))
      call check_boundaries(file, check, nv, sizes(-per%boundary))
      call count_nodes(file, check, 'bolt', sizes(-per%bar), sizes(-per%node))
      if (sizes(-per%bar) > 0) sizes(-per%bar_energy) = 4
      call count_nodes(file, check, 'liner', n_linings, sizes(-per%liner_node))
      sizes(-per%bolt_force) = max(sizes(-per%bolt), sizes(-per%node))
      call check_tables(file, check, sizes)
      if (.not. check%passed()) call make_error(error, error_code%input, file%path//': error: the file is damaged: '// &
                                                check%problem())
   end subroutine check_results_shape

   !> Check the model, and its numbers of blocks, vertices, and fixed, loading and measured points.
   subroutine check_model(file, check, nb, nv, points)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      integer, intent(out) :: nb, nv, points(3)
      character(len=*), parameter :: kinds(3) = [character(len=15) :: 'fixed_points', 'loading_points', &
                                                 'measured_points']
      integer, allocatable :: numbers(:)
      type(error_type), allocatable :: error
      integer :: i
      check%group = 'model'
      nb = rows_of(file, check, 'block_area', reals, [integer ::])
      nv = rows_of(file, check, 'vertices', reals, [2])
      call check%has_shape(nb >= 1, 'block_area')
      call check%has_shape(rows_of(file, check, 'vertex_offset', integers, [integer ::]) - 1 == nb, 'vertex_offset')
      call check%has_shape(rows_of(file, check, 'edge_joint', integers, [integer ::]) == nv, 'edge_joint')
      call check%has_shape(rows_of(file, check, 'block_material', integers, [integer ::]) == nb, 'block_material')
      call check%has_shape(rows_of(file, check, 'block_centroid', reals, [2]) == nb, 'block_centroid')
      do i = 1, 3
         points(i) = rows_of(file, check, trim(kinds(i)), reals, [2])
      end do
      call take_integers('vertex_offset')
      if (check%passed()) call check%are_offsets(numbers, nv, 3, 'vertex_offset')
      call take_integers('edge_joint')
      if (check%passed()) call check%in_range(numbers, 0, huge(1), 'edge_joint')
      call take_integers('block_material')
      if (check%passed()) call check%in_range(numbers, 1, huge(1), 'block_material')
      if (file%exists('model/parent')) then     ! only where blocks were cut into cells
         call check%has_shape(rows_of(file, check, 'parent', integers, [integer ::]) == nb, 'parent')
         call take_integers('parent')
         if (check%passed()) call check%in_range(numbers, 0, nb - 1, 'parent')
      end if
      call take_reals('vertices')
      call take_reals('block_area')
      call take_reals('block_centroid')
      do i = 1, 3
         call take_reals(trim(kinds(i)))
         if (.not. check%passed()) return
         call file%get_attribute('model/'//trim(kinds(i)), 'block', numbers, error)
         call check%has_shape(.not. allocated(error), trim(kinds(i))//'@block')
         if (.not. check%passed()) return
         call check%has_shape(size(numbers) == points(i), trim(kinds(i))//'@block')
         call check%in_range(numbers, 0, nb - 1, trim(kinds(i))//'@block')
      end do
      if (.not. check%passed()) return
      ! older files do not have numbers
      if (.not. file%has_attribute('model/measured_points', 'number')) return
      call file%get_attribute('model/measured_points', 'number', numbers, error)
      call check%has_shape(.not. allocated(error), 'measured_points@number')
      if (.not. check%passed()) return
      call check%has_shape(size(numbers) == points(3), 'measured_points@number')
      call check%are_increasing(numbers, 1, 'measured_points@number')

   contains

      !> Read a list of integers.
      subroutine take_integers(name)
         character(len=*), intent(in) :: name
         if (.not. check%passed()) return
         call file%read('model/'//name, numbers, error)
         call check%is_read(error, file%path, name)
      end subroutine take_integers

      !> Read reals, which must be finite, as their squares.
      subroutine take_reals(name)
         character(len=*), intent(in) :: name
         real(wp), allocatable :: values(:)
         if (.not. check%passed()) return
         call file%read('model/'//name, values, error)
         call check%is_read(error, file%path, name)
         if (check%passed()) call check%has_squares(values, name)
      end subroutine take_reals

   end subroutine check_model

   !> Check bolts of the model; older files do not have them.
   subroutine check_bolts(file, check, nb, n_bolts)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      integer, intent(in) :: nb
      integer, intent(out) :: n_bolts
      integer, allocatable :: blocks(:)
      type(error_type), allocatable :: error
      n_bolts = 0
      if (.not. check%passed()) return
      if (.not. file%exists('model/bolt_blocks')) return
      check%group = 'model'
      n_bolts = rows_of(file, check, 'bolt_blocks', integers, [2])
      call check%has_shape(rows_of(file, check, 'bolt_ends', reals, [2, 2]) == n_bolts, 'bolt_ends')
      call check%has_shape(rows_of(file, check, 'bolt_properties', reals, [3]) == n_bolts, 'bolt_properties')
      if (.not. check%passed()) return
      call file%read('model/bolt_blocks', blocks, error)
      call check%is_read(error, file%path, 'bolt_blocks')
      ! -1 is the fixed outside
      if (check%passed()) call check%in_range(blocks, -1, nb - 1, 'bolt_blocks')
   end subroutine check_bolts

   !> Count the boundaries and check their edges. Older files have no table of forces, models without boundaries no
   !> edges.
   subroutine check_boundaries(file, check, nv, n_boundaries)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      integer, intent(in) :: nv
      integer, intent(out) :: n_boundaries
      integer(i8), allocatable :: shape(:)
      integer, allocatable :: edges(:)
      type(error_type), allocatable :: error
      integer :: n
      n_boundaries = 0
      if (.not. check%passed()) return
      if (file%exists('history/boundary_force')) then
         check%group = 'history'
         call file%get_shape('history/boundary_force', shape, error)
         call check%is_read(error, file%path, 'boundary_force')
         if (.not. check%passed()) return
         call check%has_shape(size(shape) == 3, 'boundary_force')
         if (.not. check%passed()) return
         n_boundaries = int(min(shape(2), int(huge(1), i8)))
      end if
      if (.not. file%exists('model/boundary_edges')) return
      check%group = 'model'
      n = rows_of(file, check, 'boundary_edges', integers, [2])
      if (.not. check%passed()) return
      call file%read('model/boundary_edges', edges, error)
      call check%is_read(error, file%path, 'boundary_edges')
      if (.not. check%passed()) return
      call check%in_range(edges(1::2), 0, n_boundaries - 1, 'boundary_edges')
      call check%in_range(edges(2::2), 0, nv - 1, 'boundary_edges')
   end subroutine check_boundaries

   !> Count bolts or linings, and their nodes, where there are any.
   subroutine count_nodes(file, check, what, n_of, n)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      character(len=*), intent(in) :: what             !! 'bolt', 'liner'
      integer, intent(out) :: n_of                     !! bolts or linings
      integer, intent(out) :: n                        !! nodes
      integer, allocatable :: first(:)
      type(error_type), allocatable :: error
      n_of = 0
      n = 0
      if (.not. check%passed()) return
      if (.not. file%exists('frames/'//what//'_state')) return
      check%group = 'model'
      call file%read('model/'//what//'_first', first, error)
      call check%is_read(error, file%path, what//'_first')
      if (.not. check%passed()) return
      call check%holds(size(first) > 0, what//'_first')
      if (.not. check%passed()) return
      n_of = size(first) - 1
      n = max(0, first(size(first)))
   end subroutine count_nodes

   !> Check the tables with a row for each step, frame or contact. After a kill some may be longer than others.
   subroutine check_tables(file, check, sizes)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      integer, intent(in) :: sizes(n_sizes)
      character(len=:), allocatable :: name
      integer, allocatable :: offsets(:)
      type(error_type), allocatable :: error
      integer :: i, m, n, slash, version
      call file%get_attribute('/', 'format_version', version, error)
      if (allocated(error)) version = 1
      m = 0
      do i = 1, n_tables
         name = trim(tables(i)%name)
         if (tables(i)%since > version) then
            if (.not. file%exists(name)) cycle
         end if
         slash = index(name, '/')
         check%group = name(:slash - 1)
         n = rows_of(file, check, name(slash + 1:), tables(i)%is_real, row_shape(tables(i), sizes))
         if (name == 'frames/contact_offset') m = n
      end do
      check%group = 'frames'
      call check%has_shape(m >= 1, 'contact_offset')
      if (.not. check%passed()) return
      call file%read('frames/contact_offset', offsets, error)
      call check%is_read(error, file%path, 'contact_offset')
      ! after a kill there may be fewer contacts than the last offsets say
      if (check%passed()) call check%are_offsets(offsets, offsets(m), 0, 'contact_offset')
   end subroutine check_tables

   !> Number of rows of a table of the present group, 0 after a failure: it must exist and have rows of this shape.
   integer function rows_of(file, check, name, of_reals, row_shape) result(n)
      type(hdf5_file_type), intent(in) :: file
      type(value_check_type), intent(inout) :: check
      character(len=*), intent(in) :: name
      logical, intent(in) :: of_reals             !! else of integers
      integer, intent(in) :: row_shape(:)         !! Fortran order
      integer(i8), allocatable :: shape(:)
      type(error_type), allocatable :: error
      logical :: fits
      n = 0
      if (.not. check%passed()) return
      call check%is_there(file%exists(check%group//'/'//name), name)
      if (.not. check%passed()) return
      call file%get_shape(check%group//'/'//name, shape, error)
      call check%is_read(error, file%path, name)
      if (.not. check%passed()) return
      fits = size(shape) == size(row_shape) + 1
      if (fits) fits = all(shape(1:size(row_shape)) == row_shape) .and. shape(size(shape)) <= huge(1)
      call check%has_shape(fits, name)
      call check%has_type(file%has_type(check%group//'/'//name, of_reals), name, of_reals)
      if (fits) n = int(shape(size(shape)))
   end function rows_of

end module rockdda_io_results_shape
