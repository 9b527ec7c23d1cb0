! SPDX-License-Identifier: MIT
!> Rows of the table of options for what stands around the blocks, for the stress in them, and for water: &boundary,
!> &in_situ, &water.
module rockdda_model_ground_options
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : water_type, boundary_type, in_situ_type
   use rockdda_model_option, only : option, list_rule
   use rockdda_model_option_rows, only : option_rows_type
   implicit none
   private
   public :: describe_water, describe_boundaries, is_quiet

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

   !> Does a boundary take up waves, once a dynamic step has begun?
   pure logical function is_quiet(boundary)
      type(boundary_type), intent(in) :: boundary
      is_quiet = .false.
      if (allocated(boundary%kind)) is_quiet = boundary%kind == 'viscous' .or. boundary%kind == 'free_field'
   end function is_quiet

   !> &boundary and &in_situ.
   subroutine describe_boundaries(table, boundaries, in_situ)
      type(option_rows_type), intent(inout) :: table
      type(boundary_type), allocatable, intent(inout) :: boundaries(:)
      type(in_situ_type), allocatable, intent(inout) :: in_situ(:)
      integer :: i

      call table%begin_list('boundary', 'Outer edges of blocks along a polyline, which are held, moved or loaded. '// &
                            'An edge belongs to it when both its ends lie within e0 of the polyline and it runs '// &
                            'along it.')
      if (.not. allocated(boundaries)) allocate (boundaries(table%n_wanted()))
      do i = 1, size(boundaries)
         call table%start_element(i, boundaries(i)%origin)
         call describe_boundary(table, boundaries(i))
      end do

      call table%begin_list('in_situ', 'Stress in the ground at the start: of the weight under a surface (surface '// &
                            'or profile, k0), or given (stress). Where several groups name a block the last one '// &
                            'counts; it replaces the stress of the block material.')
      if (.not. allocated(in_situ)) allocate (in_situ(table%n_wanted()))
      do i = 1, size(in_situ)
         call table%start_element(i, in_situ(i)%origin)
         call describe_in_situ(table, in_situ(i))
      end do
   end subroutine describe_boundaries

   !> &boundary
   subroutine describe_boundary(table, boundary)
      type(option_rows_type), intent(inout) :: table
      type(boundary_type), intent(inout) :: boundary
      character(len=*), parameter :: page = 'theory.md#boundaries'
      call table%add(option('name', &
                            'of a traction: name of the load, for rockdda fos; loads of one name belong together', &
                            applies='kind traction', default_text='none', &
                            see='factor-of-safety.md#load-factor'), boundary%name)
      call table%add(option('along', 'points of the polyline', unit='length', columns='x, y', required=.true.), &
                     boundary%along)
      call table%add(option('kind', 'fixed: no motion; roller: none along the normal of the segment; moving: with '// &
                            'a velocity; traction: loaded; viscous: a roller in static steps, dashpots that take '// &
                            'up waves from the first dynamic one on; free_field: the same at a side, beside a '// &
                            'column of the ground that moves with the record', &
                            choices='fixed|roller|moving|traction|viscous|free_field', required=.true., see=page), &
                     boundary%kind)
      call table%add(option('velocity', 'velocity', unit='length/time', columns='vx, vy', applies='kind moving', &
                            default_text='kind moving needs it'), boundary%velocity)
      call table%add(option('stress', 'stress whose traction acts on the edges, tension positive', unit='stress', &
                            columns='s11, s22, s12', applies='kind traction', &
                            default_text='one of stress, traction, pressure'), boundary%stress)
      call table%add(option('traction', 'force per length of edge', unit='stress', columns='tx, ty', &
                     applies='kind traction', default_text='one of stress, traction, pressure'), boundary%traction)
      call table%add(option('pressure', 'pressure, positive into the block', unit='stress', applies='kind traction', &
                            default_text='one of stress, traction, pressure'), boundary%pressure)
      call table%add(option('table', 'factor of velocity, stress, traction or pressure in time, linear in between', &
                            columns='t, factor', applies='kinds moving and traction', default_text='1', &
                            rule=list_rule%rising), boundary%table)
   end subroutine describe_boundary

   !> &in_situ
   subroutine describe_in_situ(table, in_situ)
      type(option_rows_type), intent(inout) :: table
      type(in_situ_type), intent(inout) :: in_situ
      call table%add(option('surface', 'y of a level surface', unit='length', &
                            default_text='one of surface, profile, stress'), in_situ%surface)
      call table%add(option('profile', 'points of the surface, x increasing; beyond its ends the surface is level', &
                     unit='length', columns='x, y', default_text='one of surface, profile, stress'), in_situ%profile)
      call table%add(option('k0', 'horizontal over vertical stress', least=0.0_wp, &
                            applies='surface, profile', default_text='surface and profile need it'), in_situ%k0)
      call table%add(option('unit_weight', 'weight per area of the ground (unit thickness)', unit='stress/length', &
                     least=0.0_wp, applies='surface, profile', default_text='of the blocks above'), in_situ%unit_weight)
      call table%add(option('surcharge', 'pressure on the surface', unit='stress', applies='surface, profile', &
                            default_text='0'), in_situ%surcharge)
      call table%add(option('stress', 'stress at y = 0, tension positive', unit='stress', columns='s11, s22, s12', &
                            default_text='one of surface, profile, stress'), in_situ%stress)
      call table%add(option('gradient', 'change of the stress with y', unit='stress/length', columns='t11, t22, t12', &
                            applies='stress', default_text='0'), in_situ%gradient)
      call table%add(option('region', 'names of regions, commas between them', default_text='all blocks'), &
                     in_situ%region)
   end subroutine describe_in_situ

end module rockdda_model_ground_options
