! SPDX-License-Identifier: MIT
!> Write model and parameters of a run to a checkpoint, and read and check them. Their places in the input files, which
!> only messages about the input need, are not kept.
!>
!> The digest of a checkpoint finds damage but is no signature: a value is not trusted because the digest matches.
!>
!> Numbers that the table of options describes stand under the name of their option, those of element i of a list under
!> GROUP_i_NAME; what is loaded must lie in the bounds of its option, or be as in a record of which nothing is given.
!> Another component that is added to these types has to be added here; tests/app/test_resume.py then has to see it
!> change the results of a resumed run.
module rockdda_io_checkpoint_model
   use rockdda_base_kinds, only : wp
   use rockdda_base_state_archive, only : positive
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_blocks, only : block_system_type, point_set_type, bolt_set_type, largest_coordinate
   use rockdda_model_bolt_numbers, only : bolt_problem
   use rockdda_model_options, only : run_options_type, is_set
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : describe_parameters
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_units, only : unit_system_names
   use rockdda_model_option, only : option_type, option_value_type, option_kind, list_rule, in_bounds, columns_of, &
      index_of_choice
   use rockdda_io_archive, only : archive_type
   implicit none
   private
   public :: exchange_blocks, exchange_parameters

contains

   !> Save or load blocks, points and bolts.
   subroutine exchange_blocks(archive, parameters, blocks)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(in) :: parameters      !! loaded
      type(block_system_type), intent(inout) :: blocks
      integer :: nb
      call archive%section('model')
      call archive%item('n_blocks', blocks%n_blocks, 1, huge(1) - 1)
      nb = blocks%n_blocks
      call archive%item('vertex_offset', blocks%vertex_offset, nb + 1, 0)
      call archive%item('vertices', blocks%vertices, [2, -1], largest_coordinate)
      if (archive%has_loaded()) then
         call archive%demand(are_offsets(blocks%vertex_offset, 3, blocks%n_vertices()), 'vertex_offset')
         call archive%demand(size(blocks%vertices, 2) >= blocks%n_vertices(), 'vertices')
      end if
      if (.not. (archive%saving .or. archive%has_loaded())) return
      call archive%item('edge_joint', blocks%edge_joint, blocks%n_vertices(), 0, size(parameters%joint_materials))
      call archive%item('block_material', blocks%block_material, nb, 1, size(parameters%block_materials))
      call archive%item('edge_node_distance', blocks%edge_node_distance)
      call archive%item('file_line', blocks%file_line)
      call archive%item('parent', blocks%parent, least=1, most=nb)
      if (archive%has_loaded()) then
         if (allocated(blocks%file_line)) call archive%demand(size(blocks%file_line) == nb, 'file_line')
         if (allocated(blocks%parent)) call archive%demand(size(blocks%parent) == nb, 'parent')
         call archive%demand(bridges_pair(blocks), 'edge_joint')
      end if
      call exchange_points(archive, 'fixed', nb, blocks%fixed)
      call exchange_points(archive, 'loading', nb, blocks%loading)
      call exchange_points(archive, 'measured', nb, blocks%measured)
      call exchange_bolts(archive, nb, blocks%bolts)
      if (.not. archive%has_loaded()) return
      call archive%section('parameters')
      call archive%demand(size(parameters%fixed_tables) == blocks%fixed%n, 'fixed_table_offset')
      call archive%demand(size(parameters%loading_tables) == blocks%loading%n, 'loading_table_offset')
   end subroutine exchange_blocks

   !> Do offsets begin with 0, grow by a number at least, and end with n?
   pure logical function are_offsets(offset, least, n)
      integer, allocatable, intent(in) :: offset(:)       !! none of them negative
      integer, intent(in) :: least, n
      integer :: m
      are_offsets = .false.
      if (.not. allocated(offset)) return
      m = size(offset)
      if (m == 0) return
      are_offsets = offset(1) == 0 .and. offset(m) == n .and. all(offset(2:) - offset(:m - 1) >= least)
   end function are_offsets

   !> Is each bridge edge (joint 0) walked back exactly once in the same block?
   pure logical function bridges_pair(blocks)
      type(block_system_type), intent(in) :: blocks
      integer :: i, j, k, first, last, n
      bridges_pair = .true.
      do i = 1, blocks%n_blocks
         first = blocks%vertex_offset(i) + 1
         last = blocks%vertex_offset(i + 1)
         if (all(blocks%edge_joint(first:last) > 0)) cycle
         do k = first, last
            if (blocks%edge_joint(k) > 0) cycle
            n = 0
            do j = first, last
               if (j == k .or. blocks%edge_joint(j) > 0) cycle
               if (same(j, next(k)) .and. same(next(j), k)) n = n + 1
            end do
            if (n /= 1) bridges_pair = .false.
            if (n /= 1) return
         end do
      end do

   contains

      !> The vertex behind vertex m of block i.
      pure integer function next(m)
         integer, intent(in) :: m
         next = merge(first, m + 1, m == last)
      end function next

      !> Are two vertices in one place?
      pure logical function same(a, b)
         integer, intent(in) :: a, b
         same = .not. any(abs(blocks%vertices(:, a) - blocks%vertices(:, b)) > 0)
      end function same

   end function bridges_pair

   !> Save or load points that move with blocks.
   subroutine exchange_points(archive, name, nb, points)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      integer, intent(in) :: nb
      type(point_set_type), intent(inout) :: points
      integer :: n
      call archive%item(name//'_n', points%n, 0)
      n = points%n
      if (n == 0) return
      call archive%item(name//'_position', points%position, [2, n], largest_coordinate)
      call archive%item(name//'_block', points%block, n, 1, nb)
      call archive%item(name//'_number', points%number, least=1)
      if (allocated(points%number)) call archive%demand(size(points%number) == n .and. all( &
         points%number(2:) > points%number(:size(points%number) - 1)), name//'_number')
   end subroutine exchange_points

   !> Save or load bolts between blocks, or a block and the fixed outside.
   subroutine exchange_bolts(archive, nb, bolts)
      type(archive_type), intent(inout) :: archive
      integer, intent(in) :: nb
      type(bolt_set_type), intent(inout) :: bolts
      call archive%item('bolt_n', bolts%n, 0)
      if (bolts%n == 0) return
      call archive%item('bolt_ends', bolts%ends, [4, bolts%n], largest_coordinate)
      call archive%item('bolt_blocks', bolts%blocks, [2, bolts%n], 0, nb)
      call archive%item('bolt_stiffness', bolts%stiffness, bolts%n, positive)
      call archive%item('bolt_pretension', bolts%pretension, bolts%n)
      call archive%item('bolt_strength', bolts%strength, bolts%n, 0.0_wp)
   end subroutine exchange_bolts

   !> Save or load all numbers of the run: those of the table of options, materials, and tables of points.
   subroutine exchange_parameters(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      type(option_rows_type) :: table, empty
      type(run_options_type) :: no_options
      type(parameters_type) :: none
      call archive%section('parameters')
      if (.not. archive%saving) then
         call describe_parameters(empty, no_options, none)
         call load_sizes(archive, empty, table)
      end if
      call describe_parameters(table, no_options, parameters)
      call exchange_rows(archive, table)
      if (.not. archive%saving) then
         call table%give_back()
         call describe_parameters(table, no_options, parameters)
      end if
      call exchange_materials(archive, parameters)
      call archive%item('ends_with_stages', parameters%ends_with_stages)
      call archive%item('given_gravity', parameters%given_gravity)
      call archive%item('first_liner_material', parameters%first_liner_material)
      call exchange_units(archive, parameters)
      call archive%fixed('weight_direction', parameters%weight_direction)
      call exchange_reductions(archive, parameters)
      call exchange_tables(archive, 'fixed_table', parameters%fixed_tables)
      call exchange_tables(archive, 'loading_table', parameters%loading_tables)
      if (archive%has_loaded()) call check_relations(archive, parameters)
   end subroutine exchange_parameters

   !> Name of the system of units.
   subroutine exchange_units(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      character(len=:), allocatable :: units
      units = trim(parameters%units)
      call archive%item('units', units, required=.true.)
      if (.not. archive%has_loaded()) return
      call archive%demand(any(units == unit_system_names), 'units')
      parameters%units = units
   end subroutine exchange_units

   !> By what the strength of joint materials is divided.
   subroutine exchange_reductions(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      real(wp), allocatable :: reductions(:, :)
      integer :: i
      if (archive%saving) reductions = reshape([(parameters%joint_materials(i)%reduction, &
                                                 i=1, size(parameters%joint_materials))], &
                                               [3, size(parameters%joint_materials)])
      call archive%item('joint_reductions', reductions, [3, size(parameters%joint_materials)])
      if (.not. archive%has_loaded()) return
      call archive%demand(all(reductions > 0), 'joint_reductions')
      do i = 1, size(reductions, 2)
         parameters%joint_materials(i)%reduction = reductions(:, i)
      end do
   end subroutine exchange_reductions

   !> Block materials: a column each. (Joint materials are a list of the table of options.)
   subroutine exchange_materials(archive, parameters)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(inout) :: parameters
      real(wp), allocatable :: blocks(:, :)
      integer :: i
      if (archive%saving) then
         allocate (blocks(13, size(parameters%block_materials)))
         do i = 1, size(blocks, 2)
            blocks(:, i) = parameters%block_materials(i)%numbers()
         end do
      end if
      call archive%item('block_materials', blocks, [13, -1])
      if (.not. archive%has_loaded()) return
      call archive%demand(size(blocks, 2) > 0 .and. all(blocks(1, :) > 0 .and. blocks(3, :) > 0 .and. &
                                                        blocks(4, :) > -1 .and. blocks(4, :) < 0.5_wp), &
                          'block_materials')
      allocate (parameters%block_materials(size(blocks, 2)))
      do i = 1, size(blocks, 2)
         call parameters%block_materials(i)%set_numbers(blocks(:, i))
      end do
   end subroutine exchange_materials

   !> Save or load time tables of points: the rows of all tables in sequence, and the last row of each table.
   subroutine exchange_tables(archive, name, tables)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(time_table_type), allocatable, intent(inout) :: tables(:)
      integer, allocatable :: offset(:)
      real(wp), allocatable :: rows(:, :)
      integer :: i
      if (archive%saving) then
         allocate (offset(size(tables) + 1))
         offset(1) = 0
         do i = 1, size(tables)
            offset(i + 1) = offset(i)
            if (allocated(tables(i)%rows)) offset(i + 1) = offset(i) + size(tables(i)%rows, 2)
         end do
         allocate (rows(3, offset(size(offset))))
         do i = 1, size(tables)
            if (allocated(tables(i)%rows)) rows(:, offset(i) + 1:offset(i + 1)) = tables(i)%rows
         end do
      end if
      call archive%item(name//'_offset', offset, least=0)
      call archive%item(name//'_rows', rows, [3, -1])
      if (.not. archive%has_loaded()) return
      call archive%demand(are_offsets(offset, 0, size(rows, 2)), name//'_offset')
      if (.not. archive%has_loaded()) return
      allocate (tables(size(offset) - 1))
      do i = 1, size(tables)
         tables(i)%rows = rows(:, offset(i) + 1:offset(i + 1))
         associate (times => tables(i)%rows(1, :))
            call archive%demand(all(times(2:) >= times(:size(times) - 1)), name//'_rows')
         end associate
      end do
   end subroutine exchange_tables

   !> Load the number of elements of each list of a table without elements, for the table that is loaded then. The last
   !> element must be in the file; otherwise the number is 0, and loading fails.
   subroutine load_sizes(archive, empty, table)
      type(archive_type), intent(inout) :: archive
      type(option_rows_type), intent(in) :: empty
      type(option_rows_type), intent(inout) :: table
      character(len=:), allocatable :: name
      integer :: i, n
      do i = 1, empty%n_groups
         if (.not. empty%groups(i)%is_list) cycle
         name = trim(empty%groups(i)%name)
         n = 0
         call archive%item('n_'//name, n)
         if (allocated(archive%error)) return
         if (n == 0) cycle
         if (archive%length(name//'_'//to_string(n)) >= 0) then
            call table%want(name, n)
         else
            call archive%refuse('n_'//name, 'holds an impossible number')
         end if
      end do
   end subroutine load_sizes

   !> Save or load the values of all rows. Elements of a list are marked by their number.
   subroutine exchange_rows(archive, table)
      type(archive_type), intent(inout) :: archive
      type(option_rows_type), intent(inout) :: table
      character(len=:), allocatable :: prefix
      integer :: i, mark
      if (archive%saving) then
         do i = 1, table%n_groups
            if (table%groups(i)%is_list) call archive%item('n_'//trim(table%groups(i)%name), table%groups(i)%n)
         end do
      end if
      do i = 1, table%n
         associate (row => table%rows(i))
            if (row%element == 0) then
               if (row%in_run) call exchange_value(archive, row%name, row, row%used)
            else
               prefix = trim(table%groups(row%group)%name)//'_'//to_string(row%element)
               mark = row%element
               if (.not. table%is_beside(i, i - 1)) call archive%item(prefix, mark)
               call exchange_value(archive, prefix//'_'//row%name, row, row%given)
            end if
         end associate
      end do
   end subroutine exchange_rows

   !> Save or load one value.
   subroutine exchange_value(archive, name, row, value)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(option_type), intent(in) :: row
      type(option_value_type), intent(inout) :: value
      type(option_value_type) :: before
      before = value
      select case (row%kind)
      case (option_kind%number, option_kind%computed)
         call archive%item(name, value%number)
         call archive%demand(may_be(row, value%number, before%number), name)
      case (option_kind%whole)
         call archive%item(name, value%whole)
         call archive%demand(in_bounds(row, real(value%whole, wp)) .or. value%whole == before%whole, name)
      case (option_kind%logical); call archive%item(name, value%flag)
      case (option_kind%text); call archive%item(name, value%text, row%required)
      case (option_kind%choice)
         if (row%true_for > 0) call archive%item(name, value%flag)
         if (row%true_for == 0) call archive%item(name, value%text, row%required)
         if (row%true_for == 0 .and. allocated(value%text)) &
            call archive%demand(len(value%text) == 0 .or. index_of_choice(row, value%text) > 0, name)
      case (option_kind%numbers); call archive%fixed(name, value%numbers, -largest_coordinate, largest_coordinate)
      case (option_kind%list); call archive%item(name, value%numbers)
      case (option_kind%wholes); call archive%item(name, value%wholes)
      case (option_kind%rows, option_kind%file, option_kind%record)
         call archive%item(name, value%rows)
         if (archive%has_loaded()) call check_rows(archive, name, row, value%rows)
      end select
   end subroutine exchange_value

   !> Can a number be: is it in the bounds, as it was before, or 0 for one that need not be given?
   pure logical function may_be(row, number, before)
      type(option_type), intent(in) :: row
      real(wp), intent(in) :: number, before
      may_be = in_bounds(row, number) .or. .not. abs(number - before) > 0
      if (.not. is_set(before)) may_be = may_be .or. .not. abs(number) > 0
   end function may_be

   !> Check rows of numbers: their columns, and times in order.
   subroutine check_rows(archive, name, row, rows)
      type(archive_type), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(option_type), intent(in) :: row
      real(wp), allocatable, intent(in) :: rows(:, :)
      logical :: rising
      if (.not. allocated(rows)) then
         if (row%required) call archive%refuse(name, 'is missing')
         return
      end if
      if (size(rows, 1) /= size(columns_of(row))) call archive%refuse(name, 'has an unexpected shape')
      rising = row%rule == list_rule%rising .or. row%rule == list_rule%or_constant
      if (row%kind /= option_kind%rows) rising = row%rule /= list_rule%any_order
      if (rising) call archive%demand(all(rows(1, 2:) >= rows(1, :size(rows, 2) - 1)), name)
   end subroutine check_rows

   !> Check what the bounds of the table of options do not say: numbers that have been computed or depend on each other,
   !> and what a run has always.
   subroutine check_relations(archive, p)
      type(archive_type), intent(inout) :: archive
      type(parameters_type), intent(in) :: p
      integer :: i
      call archive%demand(p%dt_max > 0 .and. p%dt_min > 0 .and. p%dt_min <= p%dt_max, 'dt_min')
      call archive%demand(p%displacement_ratio > 0, 'displacement_ratio')
      call archive%demand(p%w0 > 0 .and. p%w0 <= largest_coordinate, 'w0')
      call archive%demand(p%normal_stiffness > 0, 'stiffness')
      call archive%demand(p%shear_stiffness > 0, 'shear_stiffness')
      call archive%demand(p%stiffness_length >= 0, 'stiffness_length')
      call archive%demand(p%fixed_stiffness > 0, 'fixed_stiffness')
      call archive%demand(p%search_distance >= 0, 'search_distance')
      call archive%demand(p%angle_tolerance >= 0 .and. p%angle_tolerance < 1.6_wp, 'angle_tolerance')
      call archive%demand(p%close_tolerance >= 0 .and. p%close_tolerance <= p%w0, 'close_tolerance')
      call archive%demand(p%open_tolerance >= 0 .and. p%open_tolerance <= p%w0, 'open_tolerance')
      if (.not. allocated(p%title)) call archive%refuse('title', 'is missing')
      if (.not. allocated(p%solver_method)) call archive%refuse('method', 'is missing')
      if (.not. allocated(p%preconditioner)) call archive%refuse('preconditioner', 'is missing')
      call archive%demand(size(p%joint_materials) > 0, 'joint_materials')
      do i = 1, size(p%joint_materials)
         if (.not. allocated(p%joint_materials(i)%law)) &
            call archive%refuse('joint_material_'//to_string(i)//'_law', 'is missing')
      end do
      do i = 1, size(p%bolts)
         call archive%demand(len(bolt_problem(p%bolts(i))) == 0, 'bolt_'//to_string(i))
      end do
      do i = 1, size(p%quakes)
         call archive%demand(allocated(p%quakes(i)%direction) .and. allocated(p%quakes(i)%apply) .and. &
                             size(p%quakes(i)%rows) > 0, 'quake_'//to_string(i)//'_record')
      end do
   end subroutine check_relations

end module rockdda_io_checkpoint_model
