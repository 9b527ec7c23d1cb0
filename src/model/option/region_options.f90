! SPDX-License-Identifier: MIT
!> The groups &region and &subdivide of the options.
module rockdda_model_region_options
   use rockdda_base_kinds, only : wp
   use rockdda_model_option, only : option
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_options, only : region_type, subdivision_type
   implicit none
   private
   public :: describe_regions

contains

   !> &region and &subdivide
   subroutine describe_regions(table, regions, subdivisions)
      type(option_rows_type), intent(inout) :: table
      type(region_type), allocatable, intent(inout) :: regions(:)
      type(subdivision_type), allocatable, intent(inout) :: subdivisions(:)
      integer :: i

      call table%begin_list('region', 'Blocks with a common name: those with more than half of their area, at the '// &
                       'start, '// &
                       'in boxes, circles, polygons or a ring, or those of block materials. One of these in each '// &
                       'group; groups of one name add up.')
      if (.not. allocated(regions)) allocate (regions(table%n_wanted()))
      do i = 1, size(regions)
         call table%start_element(i, regions(i)%origin)
         call describe_region(table, regions(i))
      end do

      call table%begin_list('subdivide', 'Cut blocks into cells along the lines of a lattice. A block that several '// &
                       'groups name is cut by the last of them.')
      if (.not. allocated(subdivisions)) allocate (subdivisions(table%n_wanted()))
      do i = 1, size(subdivisions)
         call table%start_element(i, subdivisions(i)%origin)
         call describe_subdivision(table, subdivisions(i))
      end do
   end subroutine describe_regions

   !> &region
   subroutine describe_region(table, region)
      type(option_rows_type), intent(inout) :: table
      type(region_type), intent(inout) :: region
      call table%add(option('name', 'name of the region; case and outer blanks do not count', required=.true.), &
                     region%name)
      call table%add(option('box', 'one or several boxes', unit='length', columns='xmin, ymin, xmax, ymax'), &
                     region%boxes)
      call table%add(option('circle', 'one or several circles', unit='length', columns='x, y, r'), region%circles)
      call table%add(option('polygon', 'corners of one polygon, in either direction', unit='length', columns='x, y'), &
                     region%polygon)
      call table%add(option('material', 'numbers or names of block materials, commas '// &
                            'between them'), region%material)
      call table%add(option('outline', 'names of regions before this one, commas between them: a ring around their '// &
                            'blocks'), region%outline)
      call table%add(option('width', 'of the ring', unit='length', above=0.0_wp, default_text='required with outline', &
                            applies='outline'), region%width)
   end subroutine describe_region

   !> &subdivide
   subroutine describe_subdivision(table, subdivision)
      type(option_rows_type), intent(inout) :: table
      type(subdivision_type), intent(inout) :: subdivision
      call table%add(option('region', 'names of regions, commas between them', default_text='all blocks'), &
                     subdivision%region)
      call table%add(option('size', 'length of the sides of the cells', unit='length', above=0.0_wp, required=.true.), &
                     subdivision%size)
      call table%add(option('kind', 'shape of the cells', choices='rectangles|triangles', default_word='rectangles'), &
                     subdivision%kind)
      call table%add(option('joint_material', 'number or name of the joint material between the cells of a block', &
                            required=.true., or_number=.true.), subdivision%joint_material)
   end subroutine describe_subdivision

end module rockdda_model_region_options
