! SPDX-License-Identifier: MIT
!> Regions: blocks with a common name.
!>
!> A block belongs to a region when more than half of its area lies inside at the start: in the union of the boxes,
!> circles and polygons of all groups of the name. A ring holds what lies within its width of the blocks of another
!> region. Names are compared without case and outer blanks. Lists of names have commas between them.
module rockdda_model_regions
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : is_given, lower_case
   use rockdda_geometry_common_area, only : shape_type, set_box, set_circle, set_polygon, common_area
   use rockdda_geometry_polygons, only : polygon_area
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : region_type
   implicit none
   private
   public :: blocks_of_region, shares_in_region, has_region, count_words, word_of, same_name, material_number

   !> Blocks belong to a region when more than this share of their area lies inside. A share of one half, up to the
   !> rounding of the area of a block far from the origin, is not more than a half.
   real(wp), parameter :: half = 0.5_wp + 1.0e-9_wp

contains

   !> Which blocks belong to the regions of a list of names? An empty list: all blocks.
   pure recursive function blocks_of_region(blocks, regions, names) result(inside)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      character(len=*), intent(in) :: names
      logical, allocatable :: inside(:)          !! (blocks)
      integer :: k
      allocate (inside(blocks%n_blocks), source=len_trim(names) == 0)
      if (len_trim(names) == 0) return
      do k = 1, count_words(names)
         inside = inside .or. shares_in_region(blocks, regions, word_of(names, k)) > half
      end do
   end function blocks_of_region

   !> Share of the area of each block that lies in a region.
   pure recursive function shares_in_region(blocks, regions, name) result(share)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      character(len=*), intent(in) :: name
      real(wp), allocatable :: share(:)          !! (blocks)
      type(shape_type), allocatable :: shapes(:)
      logical, allocatable :: named(:), belongs(:), within(:), excluded(:)
      integer :: i, m, n
      allocate (share(blocks%n_blocks), source=0.0_wp)
      allocate (belongs(blocks%n_blocks), excluded(blocks%n_blocks), source=.false.)
      allocate (named(size(regions)), source=.false.)
      n = 0
      do m = 1, size(regions)
         if (.not. allocated(regions(m)%name)) cycle
         named(m) = same_name(regions(m)%name, name)
         if (.not. named(m)) cycle
         n = n + count_shapes(regions(m))
         if (is_given(regions(m)%outline)) n = n + 2*blocks%n_vertices()
      end do
      allocate (shapes(n))
      n = 0
      do m = 1, size(regions)
         if (.not. named(m)) cycle
         call add_shapes(regions(m), shapes, n)
         if (is_given(regions(m)%material)) belongs = belongs .or. has_material(blocks, regions(m)%material)
         if (.not. is_given(regions(m)%outline)) cycle
         within = blocks_of_region(blocks, regions(1:m - 1), regions(m)%outline)
         excluded = excluded .or. within
         call add_ring(blocks, within, regions(m)%width, shapes, n)
      end do
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))
            if (belongs(i)) share(i) = 1
            if (.not. (belongs(i) .or. excluded(i))) share(i) = min(1.0_wp, common_area(v, shapes(1:n))/ &
                                                                    abs(polygon_area(v)))
         end associate
      end do
   end function shares_in_region

   !> Number of the shapes of a group.
   pure integer function count_shapes(region)
      type(region_type), intent(in) :: region
      count_shapes = 0
      if (allocated(region%boxes)) count_shapes = size(region%boxes, 2)
      if (allocated(region%circles)) count_shapes = count_shapes + size(region%circles, 2)
      if (allocated(region%polygon)) count_shapes = count_shapes + 1
   end function count_shapes

   !> Append the shapes of a group.
   pure subroutine add_shapes(region, shapes, n)
      type(region_type), intent(in) :: region
      type(shape_type), intent(inout) :: shapes(:)
      integer, intent(inout) :: n                !! shapes so far
      integer :: k
      if (allocated(region%boxes)) then
         do k = 1, size(region%boxes, 2)
            n = n + 1
            call set_box(shapes(n), region%boxes(:, k))
         end do
      end if
      if (allocated(region%circles)) then
         do k = 1, size(region%circles, 2)
            n = n + 1
            call set_circle(shapes(n), region%circles(1:2, k), region%circles(3, k))
         end do
      end if
      if (.not. allocated(region%polygon)) return
      n = n + 1
      call set_polygon(shapes(n), region%polygon)
   end subroutine add_shapes

   !> Append what lies within a distance of some blocks: strips along their edges, and circles about their corners.
   pure subroutine add_ring(blocks, chosen, width, shapes, n)
      type(block_system_type), intent(in) :: blocks
      logical, intent(in) :: chosen(:)           !! (blocks)
      real(wp), intent(in) :: width
      type(shape_type), intent(inout) :: shapes(:)
      integer, intent(inout) :: n                !! shapes so far
      real(wp) :: p(2), q(2), out(2)
      integer :: i, k
      do i = 1, blocks%n_blocks
         if (.not. chosen(i)) cycle
         do k = blocks%vertex_offset(i) + 1, blocks%vertex_offset(i + 1)
            p = blocks%vertices(:, k)
            q = blocks%vertices(:, merge(blocks%vertex_offset(i) + 1, k + 1, k == blocks%vertex_offset(i + 1)))
            ! corners run counter-clockwise
            out = width*[q(2) - p(2), p(1) - q(1)]/norm2(q - p)
            call set_circle(shapes(n + 1), p, width)
            call set_polygon(shapes(n + 2), reshape([p, p + out, q + out, q], [2, 4]))
            n = n + 2
         end do
      end do
   end subroutine add_ring

   !> Which blocks have one of some materials?
   pure function has_material(blocks, materials)
      type(block_system_type), intent(in) :: blocks
      character(len=*), intent(in) :: materials  !! numbers, commas between them
      logical :: has_material(blocks%n_blocks)
      integer :: k
      has_material = .false.
      do k = 1, count_words(materials)
         has_material = has_material .or. blocks%block_material == material_number(word_of(materials, k))
      end do
   end function has_material

   !> Is there a region of this name?
   pure logical function has_region(regions, name)
      type(region_type), intent(in) :: regions(:)
      character(len=*), intent(in) :: name
      integer :: i
      has_region = .false.
      do i = 1, size(regions)
         if (allocated(regions(i)%name)) has_region = has_region .or. same_name(regions(i)%name, name)
      end do
   end function has_region

   !> Number of the material that a word names, 0 if none. Names of materials are to be found here once
   !> block materials have names.
   pure integer function material_number(word)
      character(len=*), intent(in) :: word
      integer :: status
      material_number = 0
      if (len_trim(word) == 0 .or. len_trim(word) > 9 .or. verify(trim(word), '0123456789') > 0) return
      read (word, *, iostat=status) material_number
      if (status /= 0) material_number = 0
   end function material_number

   !> Are two names the same?
   pure logical function same_name(a, b)
      character(len=*), intent(in) :: a, b
      same_name = lower_case(trim(adjustl(a))) == lower_case(trim(adjustl(b)))
   end function same_name

   !> Number of words of a list, empty ones between commas included.
   pure integer function count_words(list)
      character(len=*), intent(in) :: list
      integer :: i
      count_words = 1 + count([(list(i:i) == ',', i=1, len(list))])
   end function count_words

   !> Word k of a list, without outer blanks.
   pure function word_of(list, k) result(word)
      character(len=*), intent(in) :: list
      integer, intent(in) :: k
      character(len=:), allocatable :: word
      integer :: i, comma
      word = list
      do i = 2, k
         word = word(index(word, ',') + 1:)
      end do
      comma = index(word, ',')
      if (comma > 0) word = word(1:comma - 1)
      word = trim(adjustl(word))
   end function word_of

end module rockdda_model_regions
