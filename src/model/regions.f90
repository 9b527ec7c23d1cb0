! SPDX-License-Identifier: MIT
!> Regions: blocks with a common name.
!>
!> A block belongs to a region by its centroid at the start; the outline of a box, circle or polygon counts as inside.
!> Names are compared without case and outer blanks. Lists of names have commas between them.
module rockdda_model_regions
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case
   use rockdda_geometry_polygons, only : polygon_properties, point_in_polygon, distance_to_outline
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : region_type
   implicit none
   private
   public :: blocks_of_region, has_region, count_words, word_of, same_name, material_number

contains

   !> Which blocks belong to the regions of a list of names? An empty list: all blocks.
   pure function blocks_of_region(blocks, regions, names) result(inside)
      type(block_system_type), intent(in) :: blocks
      type(region_type), intent(in) :: regions(:)
      character(len=*), intent(in) :: names
      logical, allocatable :: inside(:)          !! (blocks)
      real(wp) :: area, centroid(2), moments(3)
      integer :: i, k, m
      allocate (inside(blocks%n_blocks), source=len_trim(names) == 0)
      if (len_trim(names) == 0) return
      do i = 1, blocks%n_blocks
         call polygon_properties(blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)), &
                                 area, centroid, moments)
         do k = 1, count_words(names)
            do m = 1, size(regions)
               if (.not. same_name(regions(m)%name, word_of(names, k))) cycle
               inside(i) = inside(i) .or. is_in_group(regions(m), centroid, blocks%block_material(i))
            end do
         end do
      end do
   end function blocks_of_region

   !> Does a group of a region hold a block?
   pure logical function is_in_group(region, centroid, material)
      type(region_type), intent(in) :: region
      real(wp), intent(in) :: centroid(2)
      integer, intent(in) :: material            !! of the block
      integer :: k
      is_in_group = .false.
      if (allocated(region%boxes)) then
         do k = 1, size(region%boxes, 2)
            is_in_group = is_in_group .or. (all(centroid >= region%boxes(1:2, k)) .and. &
                                            all(centroid <= region%boxes(3:4, k)))
         end do
      end if
      if (allocated(region%circles)) then
         do k = 1, size(region%circles, 2)
            is_in_group = is_in_group .or. norm2(centroid - region%circles(1:2, k)) <= region%circles(3, k)
         end do
      end if
      if (allocated(region%polygon)) is_in_group = is_in_group .or. point_in_polygon(centroid, region%polygon) .or. &
                                                   distance_to_outline(centroid, region%polygon) <= 0
      if (allocated(region%material)) then
         do k = 1, count_words(region%material)
            is_in_group = is_in_group .or. material_number(word_of(region%material, k)) == material
         end do
      end if
   end function is_in_group

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

   !> Number of the material that a word stands for, 0 if none. Names of materials are to be found here once
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
