! SPDX-License-Identifier: MIT
!> Water in a results file: which stretches of edges it wets, and its pressure. Only files of models with water have
!> these datasets.
!>
!>     model/water_edges         (n, 4) group, both vertices of the edge, joint material on the other side (0: free)
!>     model/water_ends          (n, 2) ends of the stretch, shares of the edge's length
!>     model/water_unit_weight   (groups) of groups with a table, else 0
!>     model/water_table         (m, 2) points x, y of all tables, and water_table_group (m)
!>     model/water_level_rise    (m) with water_level_time and water_level_group
!>     model/water_pressure      (m) with water_points (m, 2) and water_points_group
!>
!> Groups and vertices count from 0; model/water_names holds the names of the groups and model/water_stage
!> for each stage the names of those that act (empty: all).
module rockdda_io_results_water
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_error, only : error_type
   use rockdda_model_options, only : water_type, is_set
   use rockdda_io_digest, only : fold
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_results_header, only : results_header_type
   implicit none
   private
   public :: write_water, add_water_total

   character(len=*), parameter :: whole(4) = [character(len=24) :: 'model/water_edges', 'model/water_table_group', &
                                              'model/water_level_group', 'model/water_points_group']
   character(len=*), parameter :: real(7) = [character(len=24) :: 'model/water_ends', 'model/water_unit_weight', &
      'model/water_table', 'model/water_level_time', 'model/water_level_rise', 'model/water_points', &
      'model/water_pressure']

contains

   !> Write the water of the header, if there is any.
   subroutine write_water(file, header, error)
      type(hdf5_file_type), intent(in) :: file
      type(results_header_type), intent(in) :: header
      type(error_type), allocatable, intent(out) :: error
      character(len=80), allocatable :: names(:)
      real(wp), allocatable :: rows(:, :), unit_weight(:)
      integer, allocatable :: group(:)
      integer :: g, n
      if (.not. allocated(header%water)) return
      if (size(header%water) == 0) return
      n = size(header%water_edges, 2)
      call file%write('model/water_edges', [4, n], &
                      reshape(header%water_edges - spread([1, 1, 1, 0], 2, n), [4*n]), error)
      if (allocated(error)) return
      allocate (names(size(header%water)), unit_weight(size(header%water)))
      names = ''
      unit_weight = 0
      do g = 1, size(names)
         if (allocated(header%water(g)%name)) names(g) = adjustl(header%water(g)%name)
         if (is_set(header%water(g)%unit_weight)) unit_weight(g) = header%water(g)%unit_weight
      end do
      call file%write_texts('model/water_names', names, error)
      if (.not. allocated(error) .and. allocated(header%stage_water)) &
         call file%write_texts('model/water_stage', header%stage_water, error)
      if (.not. allocated(error)) call file%write('model/water_ends', [2, n], reshape(header%water_ends, [2*n]), error)
      if (.not. allocated(error)) call file%write('model/water_unit_weight', [size(names)], unit_weight, error)
      call collect(header%water, 1, rows, group)
      call put('model/water_table', rows(1:2, :))
      call put_group('model/water_table_group')
      call collect(header%water, 2, rows, group)
      call put('model/water_level_time', rows(1:1, :))
      call put('model/water_level_rise', rows(2:2, :))
      call put_group('model/water_level_group')
      call collect(header%water, 3, rows, group)
      call put('model/water_points', rows(1:2, :))
      call put('model/water_pressure', rows(3:3, :))
      call put_group('model/water_points_group')

   contains

      !> Write columns.
      subroutine put(name, columns)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: columns(:, :)
         if (allocated(error)) return
         if (size(columns, 1) == 1) then
            call file%write(name, [size(columns, 2)], columns(1, :), error)
         else
            call file%write(name, [size(columns, 1), size(columns, 2)], reshape(columns, [size(columns)]), error)
         end if
      end subroutine put

      !> Write the groups of rows.
      subroutine put_group(name)
         character(len=*), intent(in) :: name
         if (.not. allocated(error)) call file%write(name, [size(group)], group - 1, error)
      end subroutine put_group

   end subroutine write_water

   !> Rows of all groups: of tables (1), levels (2) or pressures (3), and their groups.
   subroutine collect(water, what, rows, group)
      type(water_type), intent(in) :: water(:)
      integer, intent(in) :: what
      real(wp), allocatable, intent(out) :: rows(:, :)      !! (3, n)
      integer, allocatable, intent(out) :: group(:)         !! (n)
      integer :: g, k
      allocate (rows(3, 0), group(0))
      do g = 1, size(water)
         select case (what)
         case (1)
            if (allocated(water(g)%table)) call append(water(g)%table)
         case (2)
            if (allocated(water(g)%level)) call append(water(g)%level)
         case default
            if (allocated(water(g)%pressure)) call append(water(g)%pressure)
         end select
      end do

   contains

      !> Append the rows of one group.
      subroutine append(more)
         real(wp), intent(in) :: more(:, :)
         real(wp), allocatable :: longer(:, :)
         allocate (longer(3, size(rows, 2) + size(more, 2)))
         longer(:, 1:size(rows, 2)) = rows
         longer(:, size(rows, 2) + 1:) = 0
         longer(1:size(more, 1), size(rows, 2) + 1:) = more
         call move_alloc(longer, rows)
         group = [group, [(g, k=1, size(more, 2))]]
      end subroutine append

   end subroutine collect

   !> Add the datasets to the checksum of the model.
   subroutine add_water_total(file, total, error)
      type(hdf5_file_type), intent(in) :: file
      integer(i8), intent(inout) :: total
      type(error_type), allocatable, intent(out) :: error
      integer, allocatable :: integers(:)
      real(wp), allocatable :: reals(:)
      integer :: i
      if (.not. file%exists('model/water_edges')) return
      do i = 1, size(whole)
         call file%read(trim(whole(i)), integers, error)
         if (allocated(error)) return
         total = fold(total, integers)
      end do
      do i = 1, size(real)
         call file%read(trim(real(i)), reals, error)
         if (allocated(error)) return
         total = fold(total, reals)
      end do
   end subroutine add_water_total

end module rockdda_io_results_water
