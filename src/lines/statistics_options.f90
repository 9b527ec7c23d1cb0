! SPDX-License-Identifier: MIT
!> The groups of a file of joint statistics (.dl) as rows of a table of options: reader, hints, and help are loops over
!> them. docs/cutting.md explains the values.
module rockdda_lines_statistics_options
   use rockdda_base_kinds, only : wp
   use rockdda_base_random, only : largest_seed
   use rockdda_lines_statistics, only : statistics_type, joint_set_type, opening_type, region_type, extra_line_type, &
                                        points_type
   use rockdda_model_option, only : option, list_rule
   use rockdda_model_option_rows, only : option_rows_type
   implicit none
   private
   public :: all_statistics, describe_statistics

   character(len=*), parameter :: laws = 'uniform|normal|lognormal|exponential'      ! as law%... count them

contains

   !> All groups, one element of each list, as they are before anything is given.
   function all_statistics() result(table)
      type(option_rows_type) :: table
      type(statistics_type) :: statistics
      call table%want_one_each()
      call describe_statistics(table, statistics)
   end function all_statistics

   !> The whole table, bound to these statistics.
   subroutine describe_statistics(table, statistics)
      type(option_rows_type), intent(inout) :: table
      type(statistics_type), intent(inout) :: statistics
      integer :: i
      call describe_boundary(table, statistics%region)

      call table%begin_list('joint_set', 'A set of parallel joints.')
      if (.not. allocated(statistics%sets)) allocate (statistics%sets(table%n_wanted()))
      do i = 1, size(statistics%sets)
         call table%start_element(i, statistics%sets(i)%origin)
         call describe_set(table, statistics%sets(i))
      end do

      call table%begin_list('opening', 'An opening in the rock.')
      if (.not. allocated(statistics%openings)) allocate (statistics%openings(table%n_wanted()))
      do i = 1, size(statistics%openings)
         call table%start_element(i, statistics%openings(i)%origin)
         call describe_opening(table, statistics%openings(i))
      end do

      call describe_lines(table, 'line', 'A line of its own, cut to the rock.', 'joint_material', statistics%lines)
      call describe_points(table, 'fixed', 'Points and lines that hold blocks.', statistics%fixed_groups)
      call describe_points(table, 'loading', 'Points that can carry loads.', statistics%loading_groups)
      call describe_points(table, 'measured', 'Points whose motion is recorded.', statistics%measured_groups)
      call describe_lines(table, 'material_line', 'A line that gives its material to the blocks that it crosses.', &
                          'block_material', statistics%material_lines)
      call table%begin('section', 'The plane of the drawing, for sets that dip and dip direction give.')
      call table%add(option('azimuth', 'of the x axis', unit='deg', required=.true.), statistics%azimuth)
      call table%begin('lines', 'What is drawn.')
      call table%add(option('seed', 'of the random numbers', least=0.0_wp, most=real(largest_seed, wp)), &
                     statistics%seed)
      call table%add(option('edge_node_distance', 'below which cutting does not distinguish points', unit='length', &
                            above=0.0_wp, default_text='0.001 of the smallest spacing'), statistics%edge_node_distance)
   end subroutine describe_statistics

   !> &boundary
   subroutine describe_boundary(table, region)
      type(option_rows_type), intent(inout) :: table
      type(region_type), intent(inout) :: region
      call table%begin('boundary', 'The outline of the rock: a window, perhaps with a slope or a frame, or a polygon.')
      call table%add_reals(option('window', 'the outline is this box', unit='length', rule=list_rule%box, &
                                  columns='xmin, ymin, xmax, ymax', default_text='vertices'), region%window)
      call table%add(option('vertices', 'the outline is this polygon', unit='length', columns='x, y', &
                            default_text='window'), region%vertices)
      call table%add_reals(option('slope_toe', 'of a slope cut into the window', unit='length', columns='x, y', &
                                  default_text='no slope'), region%slope_toe)
      call table%add(option('slope_angle', 'of its face; it rises to the right up to 90 degrees, to the left beyond', &
                            unit='deg', above=0.0_wp, below=180.0_wp, default_text='no slope'), region%slope_angle)
      call table%add(option('frame', 'thickness of four fixed blocks around the window', unit='length', above=0.0_wp, &
                            default_text='no frame'), region%frame)
      call table%add(option('joint_material', 'of the outline', least=1.0_wp), region%material)
   end subroutine describe_boundary

   !> &joint_set
   subroutine describe_set(table, set)
      type(option_rows_type), intent(inout) :: table
      type(joint_set_type), intent(inout) :: set
      call table%add(option('inclination', 'of the traces, counter-clockwise from +x', unit='deg', least=-360.0_wp, &
                            most=360.0_wp, default_text='from dip and dip_direction'), set%inclination)
      call table%add(option('dip', 'of the planes', unit='deg', least=0.0_wp, most=90.0_wp, &
                            default_text='inclination'), set%dip)
      call table%add(option('dip_direction', 'of the planes, from north', unit='deg', least=-360.0_wp, most=360.0_wp, &
                            default_text='inclination'), set%dip_direction)
      call table%add(option('spacing', 'mean distance of neighbouring lines; with dip, of the planes', unit='length', &
                            above=0.0_wp, required=.true.), set%spacing)
      call table%add(option('trace', 'mean length of a trace', unit='length', above=0.0_wp, default_text='endless'), &
                     set%trace)
      call table%add(option('bridge', 'mean gap between the traces of a line', unit='length', least=0.0_wp), set%bridge)
      call table%add(option('randomness', 'degree of randomness, or coefficient of variation', least=0.0_wp, &
                            most=0.5_wp, default_text='0; exponential: 0.5; normal, lognormal: required'), &
                     set%randomness)
      call table%add(option('joint_material', 'of the joints', least=1.0_wp), set%material)
      call table%add(option('offset', "distance of line 0 from the origin, along the set's normal", unit='length'), &
                     set%offset)
      call table%add(option('start', 'start of a trace of line 0, along the line from the foot of the origin', &
                            unit='length'), set%start)
      call table%add(option('stagger', 'shift of traces from line to line, as a share of trace and bridge; with '// &
                            'ends_at, of the spacing', least=-1.0_wp, most=1.0_wp), set%stagger)
      call table%add(option('distribution', 'of the spacing', choices=laws, default_word='uniform'), set%distribution)
      call table%add(option('trace_distribution', 'of trace and bridge', choices=laws, default_from='distribution'), &
                     set%trace_distribution)
      call table%add(option('ends_at', 'number of an endless set: these joints run from one line of it to the next', &
                            least=1.0_wp, default_text='none'), set%ends_at)
      call table%add(option('avoid_cantilevers', 'shift the set for the first opening'), set%avoid_cantilevers)
   end subroutine describe_set

   !> &opening
   subroutine describe_opening(table, opening)
      type(option_rows_type), intent(inout) :: table
      type(opening_type), intent(inout) :: opening
      character(len=*), parameter :: needed = 'required with its shape'
      call table%add(option('shape', 'of the opening', choices='horseshoe|circle|rectangle|polygon', &
                            default_text='required without outline'), opening%shape_name)
      call table%add(option('span', 'of a horseshoe', unit='length', above=0.0_wp, default_text=needed), opening%span)
      call table%add(option('wall_height', 'of a horseshoe', unit='length', least=0.0_wp, default_text=needed), &
                     opening%wall_height)
      call table%add(option('arch_height', 'of the arch of a horseshoe, at most half the span', unit='length', &
                            above=0.0_wp, default_text=needed), opening%arch_height)
      call table%add(option('radius', 'of a circle', unit='length', above=0.0_wp, default_text=needed), opening%radius)
      call table%add(option('width', 'of a rectangle', unit='length', above=0.0_wp, default_text=needed), opening%width)
      call table%add(option('height', 'of a rectangle', unit='length', above=0.0_wp, default_text=needed), &
                     opening%height)
      call table%add(option('vertices', 'of a polygon', unit='length', columns='x, y', &
                            default_text='required with its shape, or file'), opening%vertices)
      call table%add_reals(option('center', 'centre of the box around the shape; added to vertices', unit='length', &
                                  columns='x, y', default_text='0, 0'), opening%center)
      call table%add(option('segments', 'straight pieces of the arch or circle', least=3.0_wp, &
                            default_text='one per 10 degrees'), opening%segments)
      call table%add(option('joint_material', 'of its wall', least=1.0_wp), opening%material)
      call table%add(option('file', 'of the vertices, rows x, y; with outline, the options file', is_file=.true., &
                            default_text='with outline, the .nml of the same name'), opening%file)
      call table%add(option('outline', 'region of an options file that draws it by a polygon, a box or a circle; '// &
                            'stages excavate it', default_text='none'), opening%outline)
   end subroutine describe_opening

   !> &line and &material_line
   subroutine describe_lines(table, name, meaning, material_name, lines)
      type(option_rows_type), intent(inout) :: table
      character(len=*), intent(in) :: name, meaning, material_name
      type(extra_line_type), allocatable, intent(inout) :: lines(:)
      integer :: i
      call table%begin_list(name, meaning)
      if (.not. allocated(lines)) allocate (lines(table%n_wanted()))
      do i = 1, size(lines)
         call table%start_element(i, lines(i)%origin)
         call table%add_reals(option('ends', 'of the line', unit='length', columns='x1, y1, x2, y2', required=.true., &
                                     rule=list_rule%two_points), lines(i)%ends)
         call table%add(option(material_name, 'of the line', least=1.0_wp), lines(i)%material)
      end do
   end subroutine describe_lines

   !> &fixed, &loading and &measured
   subroutine describe_points(table, name, meaning, groups)
      type(option_rows_type), intent(inout) :: table
      character(len=*), intent(in) :: name, meaning
      type(points_type), allocatable, intent(inout) :: groups(:)
      integer :: i
      call table%begin_list(name, meaning)
      if (.not. allocated(groups)) allocate (groups(table%n_wanted()))
      do i = 1, size(groups)
         call table%start_element(i, groups(i)%origin)
         call table%add(option('points', 'their coordinates', unit='length', columns='x, y'), groups(i)%points)
         if (name == 'fixed') call table%add(option('lines', 'fixed lines', unit='length', columns='x1, y1, x2, y2'), &
                                             groups(i)%lines)
         if (name /= 'measured') cycle
         call table%add_reals(option('along', 'line of `count` points, its ends among them', unit='length', &
                                     columns='x1, y1, x2, y2', default_text='none'), groups(i)%along)
         call table%add(option('count', 'number of points along that line', least=2.0_wp, most=1.0e6_wp, &
                               default_text='none'), groups(i)%count)
      end do
   end subroutine describe_points

end module rockdda_lines_statistics_options
