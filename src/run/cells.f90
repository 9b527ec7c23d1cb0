! SPDX-License-Identifier: MIT
!> Regions of the options, and the blocks that they have cut into cells: `&region`, `&subdivide`.
module rockdda_run_cells
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity, at_word
   use rockdda_base_strings, only : counted, to_string
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_analysis_input, only : block_material_type, joint_material_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_material_names, only : number_of_material
   use rockdda_model_options, only : region_type, subdivision_type, is_set
   use rockdda_model_regions, only : blocks_of_region, shares_in_region, has_region, count_words, word_of, &
                                     material_number
   use rockdda_cutting_cell_lattice, only : cell_kind
   use rockdda_cutting_subdivision, only : cell_choice_type, count_cells, subdivide_blocks
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_check_material_names, only : no_material, unknown_number, check_joint_material
   implicit none
   private
   public :: number_regions, check_regions, report_cut_blocks, count_regions, check_names, check_cells, make_cells

   !> More cells than this are refused: a size that was meant for another unit.
   real(wp), parameter :: most_cells = 5.0e6_wp
   !> A block is cut by an outline when it has more than this share of its area on both sides.
   real(wp), parameter :: least_cut = 0.01_wp

contains

   !> Put numbers in place of the names of block materials in regions.
   subroutine number_regions(materials, regions, messages)
      type(block_material_type), intent(in) :: materials(:)   !! groups of the options that may name block materials
      type(region_type), intent(inout) :: regions(:)
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: word, numbers
      integer :: i, k, m
      do i = 1, size(regions)
         if (.not. allocated(regions(i)%material)) cycle
         numbers = ''
         do k = 1, count_words(regions(i)%material)
            word = word_of(regions(i)%material, k)
            m = number_of_material(word, materials)
            if (m < 1 .and. size(materials) > 0) then
               call messages%add(severity%error, '&region: '//no_material('block', word, materials), &
                                 at_word(regions(i)%origin, word))
               m = 1
            end if
            if (m > 0) word = to_string(m)
            if (k > 1) numbers = numbers//','
            numbers = numbers//word
         end do
         regions(i)%material = numbers
      end do
   end subroutine number_regions

   !> Errors for regions that say nothing or the impossible, warnings for those without a block.
   subroutine check_regions(blocks, regions, n_materials, messages)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      integer, intent(in) :: n_materials         !! block materials
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: name
      logical, allocatable :: inside(:)
      integer :: i, k, before
      before = messages%n_errors
      do i = 1, size(regions)
         call check_region(regions(i), regions(1:i - 1), n_materials, messages)
      end do
      if (messages%n_errors > before) return
      do i = 1, size(regions)
         if (any([(has_region(regions(k:k), regions(i)%name), k=1, i - 1)])) cycle
         inside = blocks_of_region(blocks, regions, regions(i)%name)
         name = "region '"//trim(adjustl(regions(i)%name))//"'"
         if (.not. any(inside)) call messages%add(severity%warning, name// &
            ' has no block: none has more than half of its area inside', regions(i)%origin)
      end do
   end subroutine check_regions

   !> Warn of blocks that the outline of a region cuts: a warning for each, one for all of a region in a run.
   subroutine report_cut_blocks(blocks, regions, messages)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)    !! checked
      type(diagnostics_type), intent(inout) :: messages
      integer, parameter :: most_named = 3
      character(len=:), allocatable :: name, text
      real(wp), allocatable :: share(:)
      logical, allocatable :: inside(:)
      integer, allocatable :: cut(:)
      integer :: i, k, summary
      do i = 1, size(regions)
         if (any([(has_region(regions(k:k), regions(i)%name), k=1, i - 1)])) cycle
         share = shares_in_region(blocks, regions, regions(i)%name)
         cut = pack([(k, k=1, blocks%n_blocks)], share > least_cut .and. share < 1 - least_cut)
         if (size(cut) == 0) cycle
         inside = blocks_of_region(blocks, regions, regions(i)%name)
         name = "the outline of region '"//trim(adjustl(regions(i)%name))//"' cuts "
         summary = 0
         if (size(cut) > 1) then
            text = name//to_string(size(cut))//' blocks: '//described(cut(1))
            do k = 2, min(most_named, size(cut))
               text = text//', '//described(cut(k))
            end do
            if (size(cut) > most_named) text = text//' and '//to_string(size(cut) - most_named)// &
               " more; 'rockdda check' and the log list all"
            call messages%add_summary(severity%warning, size(cut), text, regions(i)%origin, summary)
         end if
         do k = 1, size(cut)
            call messages%add(severity%warning, name//'block '//described(cut(k))//': '// &
                              trim(merge('the whole block belongs', &
                              'no part of it belongs  ', inside(cut(k))))//' to the region; draw the outline '// &
                              'along joints, or cut the block along it', regions(i)%origin, summary)
         end do
      end do

   contains

      !> "7 at (1.5, 2) with 63 % of its area inside"
      function described(block) result(words)
         integer, intent(in) :: block
         character(len=:), allocatable :: words
         real(wp) :: area, centroid(2), moments(3)
         call polygon_properties(blocks%vertices(:, blocks%vertex_offset(block) + 1:blocks%vertex_offset(block + 1)), &
                                 area, centroid, moments)
         words = to_string(block)//' at ('//to_string(centroid(1), 5)//', '//to_string(centroid(2), 5)//') with '// &
                 to_string(100*share(block), 3)//' % of its area inside'
      end function described

   end subroutine report_cut_blocks

   !> A note for each region that has blocks.
   subroutine count_regions(blocks, regions, messages)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)    !! checked
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: inside(:)
      integer :: i, k
      do i = 1, size(regions)
         if (any([(has_region(regions(k:k), regions(i)%name), k=1, i - 1)])) cycle
         inside = blocks_of_region(blocks, regions, regions(i)%name)
         if (any(inside)) call messages%add(severity%note, "region '"//trim(adjustl(regions(i)%name))//"': "// &
                                            counted(count(inside), 'block'), regions(i)%origin)
      end do
   end subroutine count_regions

   !> One group.
   subroutine check_region(region, before, n_materials, messages)
      type(region_type), intent(in) :: region
      type(region_type), intent(in) :: before(:)   !! in the file
      integer, intent(in) :: n_materials
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: word
      integer :: k, m, n
      if (.not. allocated(region%name)) return   ! reported by the reader
      if (len_trim(region%name) == 0 .or. index(region%name, ',') > 0) &
         call fail("name must have a letter and no comma, found '"//region%name//"'")
      n = count([allocated(region%boxes), allocated(region%circles), allocated(region%polygon), &
                 allocated(region%material), allocated(region%outline)])
      if (n /= 1) call fail('give one of box, circle, polygon, material, outline; groups of one name add up')
      if (allocated(region%outline) .neqv. is_set(region%width)) &
         call fail('outline, the names of regions, and width make a ring: give both. An opening and its region '// &
                   'have one outline where the region is drawn and the &opening of the statistics names it')
      if (allocated(region%outline)) call check_names('&region: outline', before, region%outline, region%origin, &
                                                      messages, ' before it')
      if (allocated(region%boxes)) then
         do k = 1, size(region%boxes, 2)
            associate (box => region%boxes(:, k))
               if (all(box(1:2) < box(3:4))) cycle
               call fail('box: xmin < xmax and ymin < ymax must hold, found '//to_string(box(1))//', '// &
                         to_string(box(2))//', '//to_string(box(3))//', '//to_string(box(4)))
            end associate
            exit
         end do
      end if
      if (allocated(region%circles)) then
         if (any(region%circles(3, :) <= 0)) call fail('circle: the radius must be greater than 0, found '// &
                                                       to_string(minval(region%circles(3, :))))
      end if
      if (allocated(region%polygon)) then
         if (size(region%polygon, 2) < 3) call fail('polygon: at least three corners are needed, found '// &
                                                     to_string(size(region%polygon, 2)))
      end if
      if (.not. allocated(region%material)) return
      do k = 1, count_words(region%material)
         word = word_of(region%material, k)
         m = material_number(word)
         if (m < 1) then
            call messages%add(severity%error, "&region: there is no block material '"//word// &
                              "': without names they are called by their numbers, 1 to "//to_string(n_materials), &
                              at_word(region%origin, word))
         else if (m > n_materials) then
            call messages%add(severity%error, '&region: '//unknown_number('block', m, n_materials), &
                              at_word(region%origin, word))
         end if
      end do

   contains

      !> An error about the group.
      subroutine fail(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&region: '//text, region%origin)
      end subroutine fail

   end subroutine check_region

   !> Errors for names that groups of cells have wrong.
   subroutine check_cells(regions, subdivisions, n_joints, named_joints, messages)
      type(region_type), intent(in) :: regions(:)
      type(subdivision_type), intent(in) :: subdivisions(:)
      integer, intent(in) :: n_joints            !! joint materials
      type(joint_material_type), intent(in) :: named_joints(:)   !! groups of the options that may name joint materials
      type(diagnostics_type), intent(inout) :: messages
      integer :: i
      do i = 1, size(subdivisions)
         associate (s => subdivisions(i))
            if (allocated(s%region)) call check_names('&subdivide', regions, s%region, s%origin, &
                                                            messages)
            if (allocated(s%joint_material)) call check_joint_material('&subdivide', s%joint_material, n_joints, &
                                                                      named_joints, s%origin, messages)
         end associate
      end do
   end subroutine check_cells

   !> Cut the blocks of the regions into cells.
   subroutine make_cells(regions, subdivisions, n_joints, named_joints, blocks, messages)
      type(region_type), intent(in) :: regions(:)
      type(subdivision_type), intent(in) :: subdivisions(:)
      integer, intent(in) :: n_joints            !! joint materials
      type(joint_material_type), intent(in) :: named_joints(:)   !! groups of the options that may name joint materials
      type(block_system_type), intent(inout) :: blocks
      type(diagnostics_type), intent(inout) :: messages
      type(cell_choice_type), allocatable :: choices(:)
      logical, allocatable :: uncut(:), inside(:)
      integer, allocatable :: choice(:)
      character(len=:), allocatable :: names
      integer :: i, before, n_blocks
      real(wp) :: n_cells
      if (size(subdivisions) == 0) return
      before = messages%n_errors
      call check_cells(regions, subdivisions, n_joints, named_joints, messages)
      if (messages%n_errors > before) return
      n_blocks = blocks%n_blocks
      allocate (inside(n_blocks))
      allocate (choices(size(subdivisions)), choice(n_blocks))
      choice = 0
      do i = 1, size(subdivisions)
         associate (s => subdivisions(i))
            names = ''
            if (allocated(s%region)) names = s%region
            choices(i) = cell_choice_type(s%size, cell_kind%rectangles, &
               number_of_material(s%joint_material, named_joints))
            if (allocated(s%kind)) choices(i)%kind = merge(cell_kind%triangles, cell_kind%rectangles, &
                                                           s%kind == 'triangles')
            inside = blocks_of_region(blocks, regions, names)
            n_cells = count_cells(blocks, choices(i), inside)
            if (n_cells > most_cells) call messages%add(severity%error, '&subdivide: cells of size '// &
               to_string(s%size)//' would be about '//to_string(n_cells, 2)//', more than '//to_string(most_cells), &
               s%origin)
            where (inside) choice = i
         end associate
      end do
      if (messages%n_errors > before) return
      call subdivide_blocks(blocks, choices, choice, uncut)
      if (any(uncut)) call messages%add(severity%warning, counted(count(uncut), 'block')//' could not be cut into '// &
         'cells and '//trim(merge('stays', 'stay ', count(uncut) == 1))//' whole, the first is block '// &
         to_string(findloc_true(uncut))//': narrower than the cells; choose another size', &
         subdivisions(choice(findloc_true(uncut)))%origin)
      call messages%add(severity%note, 'cells: '//counted(count(choice > 0 .and. .not. uncut), 'block')// &
                        ' of '//to_string(n_blocks)//' cut into '// &
                        to_string(blocks%n_blocks - count(choice == 0 .or. uncut))//', '// &
                        to_string(blocks%n_blocks)//' blocks in all')
   end subroutine make_cells

   !> Each name of a list is that of a region.
   subroutine check_names(group, regions, names, origin, messages, where)
      character(len=*), intent(in) :: group      !! that has the list
      type(region_type), intent(in) :: regions(:)
      character(len=*), intent(in) :: names
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      character(len=*), intent(in), optional :: where   !! the regions are, for the message
      character(len=80), allocatable :: known(:)
      character(len=:), allocatable :: word, place
      integer :: i, k
      if (len_trim(names) == 0) return
      place = ''
      if (present(where)) place = where
      allocate (known(size(regions)))
      known = ''
      do i = 1, size(regions)
         if (allocated(regions(i)%name)) known(i) = adjustl(regions(i)%name)
      end do
      do k = 1, count_words(names)
         word = word_of(names, k)
         if (has_region(regions, word)) cycle
         call messages%add(severity%error, group//": there is no region '"//word//"'"//place// &
                           did_you_mean(word, known), at_word(origin, word))
      end do
   end subroutine check_names

   !> Place of the first true.
   pure integer function findloc_true(flags)
      logical, intent(in) :: flags(:)
      do findloc_true = 1, size(flags)
         if (flags(findloc_true)) return
      end do
      findloc_true = 0
   end function findloc_true

end module rockdda_run_cells
