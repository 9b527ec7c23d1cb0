! SPDX-License-Identifier: MIT
!> Rows of the table of options for water: &water.
module rockdda_model_water_options
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : water_type
   use rockdda_model_option, only : option, list_rule
   use rockdda_model_option_rows, only : option_rows_type
   implicit none
   private
   public :: describe_water

contains

   !> &water.
   subroutine describe_water(table, water)
      type(option_rows_type), intent(inout) :: table
      type(water_type), allocatable, intent(inout) :: water(:)
      integer :: i
      call table%begin_list('water', 'Water in joints and on free edges: its pressure acts on both sides of every '// &
                       'wetted edge and moves with the blocks. Where several groups wet an edge the last one counts.')
      if (.not. allocated(water)) allocate (water(table%n_wanted()))
      do i = 1, size(water)
         call table%start_element(i, water(i)%origin)
         call describe_group(table, water(i))
      end do
   end subroutine describe_water

   !> One group.
   subroutine describe_group(table, water)
      type(option_rows_type), intent(inout) :: table
      type(water_type), intent(inout) :: water
      character(len=*), parameter :: page = 'theory.md#water'
      call table%add(option('name', "name of the group; groups of one name belong together, 'none' is none", &
                            default_text='none'), water%name)
      call table%add(option('table', 'points of the water table, x increasing; beyond its ends it is level, '// &
                            'and one point is a level table', unit='length', columns='x, y', &
                            default_text='one of table, pressure_file', see=page), water%table)
      call table%add(option('unit_weight', 'weight of the water per area (unit thickness): the pressure is '// &
                            'unit_weight times the depth below the table, no less than 0', unit='stress/length', &
                            above=0.0_wp, applies='table', default_text='table needs it'), water%unit_weight)
      call table%add_file(option('pressure_file', 'file with the pressure at points of a regular grid or anywhere; '// &
                                 'linear between them, in triangles', columns='x, y, p', &
                                 default_text='one of table, pressure_file', see=page, rule=list_rule%any_order), &
                          water%pressure, water%file)
      call table%add(option('joints', 'names or numbers of the joint materials that are wetted, commas between '// &
                            "them; 'none': no joint", default_text='all', or_number=.true.), water%joints)
      call table%add(option('surfaces', 'edges that face no other block are wetted, too: pools on free faces, and '// &
                            'the outline of the model'), water%surfaces)
      call table%add(option('region', 'names of regions, commas between them: blocks whose edges are wetted', &
                            default_text='all blocks'), water%region)
      call table%add(option('level', 'rise of the table in time, linear in between', unit='time, length', &
                            columns='t, dy', applies='table', default_text='0', rule=list_rule%rising), water%level)
   end subroutine describe_group

end module rockdda_model_water_options
