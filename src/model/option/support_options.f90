! SPDX-License-Identifier: MIT
!> Rows of the table of options for bolts, &bolt, and linings, &liner, and what is wrong with one.
module rockdda_model_support_options
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : bolt_type, liner_type, is_set
   use rockdda_model_option, only : option, list_rule
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_base_strings, only : is_given
   implicit none
   private
   public :: describe_bolts, describe_liners, liner_problem

contains

   !> &bolt
   subroutine describe_bolts(table, bolts)
      type(option_rows_type), intent(inout) :: table
      type(bolt_type), allocatable, intent(inout) :: bolts(:)
      integer :: i
      call table%begin_list('bolt', 'A bolt, or a pattern of equal ones. Those of the geometry file come first.')
      if (.not. allocated(bolts)) allocate (bolts(table%n_wanted()))
      do i = 1, size(bolts)
         call table%start_element(i, bolts(i)%origin)
         call describe_bolt(table, bolts(i))
      end do
   end subroutine describe_bolts

   !> One group.
   subroutine describe_bolt(table, bolt)
      type(option_rows_type), intent(inout) :: table
      type(bolt_type), intent(inout) :: bolt
      character(len=*), parameter :: pattern = 'pattern', grout = 'grouted, friction', needed = 'required there'
      call table%add(option('name', 'name of the bolt', default_text='none'), bolt%name)
      call table%add(option('kind', 'what holds it', choices='spring|grouted|end_anchored|yielding|friction', &
                            default_text='spring', see='user-guide.md'), bolt%kind)
      call table%add(option('from', 'head', unit='length', columns='x, y', default_text='a pattern', &
                            rule=list_rule%pair), bolt%from)
      call table%add(option('to', 'toe', unit='length', columns='x, y', default_text='a pattern', &
                            rule=list_rule%pair), bolt%to)
      call table%add(option('along', 'line on which the heads of a pattern lie', unit='length', columns='x, y', &
                            default_text='none'), bolt%along)
      call table%add(option('outline', 'region on whose outer line they lie', default_text='none', &
                            not_blank=.true.), bolt%outline)
      call table%add(option('spacing', 'distance of the heads', unit='length', above=0.0_wp, applies=pattern, &
                            default_text=needed), bolt%spacing)
      call table%add(option('length', 'length of the bolts', unit='length', above=0.0_wp, applies=pattern, &
                            default_text=needed), bolt%length)
      call table%add(option('angle', 'from the normal towards the rock, counter-clockwise', unit='degrees', &
                            above=-90.0_wp, below=90.0_wp, applies=pattern, default_text='0'), bolt%angle)
      call table%add(option('offset', 'of the first head from the start of the line', unit='length', least=0.0_wp, &
                            applies=pattern, default_text='half of spacing'), bolt%offset)
      call table%add(option('stiffness', 'force over change of length', unit='force/length', above=0.0_wp, &
                            applies='spring', default_text=needed), bolt%stiffness)
      call table%add(option('diameter', 'of the steel', unit='length', above=0.0_wp, default_text='by area'), &
                     bolt%diameter)
      call table%add(option('area', 'cross-section of the steel', unit='length^2', above=0.0_wp, &
                            default_text='by diameter'), bolt%area)
      call table%add(option('young', "Young's modulus of the steel", unit='stress', above=0.0_wp, &
                            default_text='required, but for a spring'), bolt%young)
      call table%add(option('pretension', 'force at the start, or when installed; tension positive', unit='force'), &
                     bolt%pretension)
      call table%add(option('yield_force', 'force at which the bolt yields', unit='force', &
                            above=0.0_wp, default_text='none: it does not yield'), bolt%yield_force)
      call table%add(option('rupture_strain', 'plastic strain at which the steel breaks', above=0.0_wp, &
                            default_text='none'), bolt%rupture_strain)
      call table%add(option('spacing_out_of_plane', 'divides the forces of one bolt', unit='length', above=0.0_wp, &
                            default_text='1'), bolt%spacing_out_of_plane)
      call table%add(option('grout_stiffness', 'shear force over length and slip', unit='force/length^2', &
                            above=0.0_wp, applies=grout, default_text=needed), bolt%grout_stiffness)
      call table%add(option('grout_strength', 'force over length at slip', unit='force/length', above=0.0_wp, &
                            applies=grout, default_text=needed), bolt%grout_strength)
      call table%add(option('grout_residual', 'share of it that remains after slip', least=0.0_wp, most=1.0_wp, &
                            applies=grout, default_text='1'), bolt%grout_residual)
      call table%add(option('free_length', 'part without grout, from the head', unit='length', columns='a, b', &
                            applies=grout, default_text='none', rule=list_rule%pair), bolt%free_length)
      call table%add(option('plate_strength', 'of the plate at the head', unit='force', above=0.0_wp, applies=grout, &
                            default_text='no plate'), bolt%plate_strength)
      call table%add(option('element', 'largest distance of nodes', unit='length', above=0.0_wp, applies=grout, &
                            default_text='length/10, less in stiff grout'), bolt%element)
      call table%add(option('plateau_force', 'force that it keeps', unit='force', above=0.0_wp, applies='yielding', &
                            default_text=needed), bolt%plateau_force)
      call table%add(option('stroke', 'by which it yields before it breaks', unit='length', above=0.0_wp, &
                            applies='yielding', default_text=needed), bolt%stroke)
      call table%add(option('shear_stiffness', "of the dowel at a joint; 'auto': a beam on bedding_stiffness", &
                            unit='force/length', or_number=.true., default_text='0'), bolt%shear_stiffness)
      call table%add(option('shear_strength', "of the dowel; 'auto': yield_force over the root of 3", unit='force', &
                            or_number=.true., default_text='unlimited'), bolt%shear_strength)
      call table%add(option('bedding_stiffness', 'force of the rock on the dowel over length and displacement', &
                     unit='stress', above=0.0_wp, applies="'auto'", default_text=needed), bolt%bedding_stiffness)
   end subroutine describe_bolt

   !> &liner
   subroutine describe_liners(table, liners)
      type(option_rows_type), intent(inout) :: table
      type(liner_type), allocatable, intent(inout) :: liners(:)
      integer :: i
      call table%begin_list('liner', 'A lining of the rock along a line, or a layer on another lining.')
      if (.not. allocated(liners)) allocate (liners(table%n_wanted()))
      do i = 1, size(liners)
         call table%start_element(i, liners(i)%origin)
         call describe_liner(table, liners(i))
      end do
   end subroutine describe_liners

   !> One group.
   subroutine describe_liner(table, liner)
      type(option_rows_type), intent(inout) :: table
      type(liner_type), intent(inout) :: liner
      character(len=*), parameter :: needed = 'required'
      call table%add(option('name', 'name of the lining', default_text="'liner N'", not_blank=.true.), liner%name)
      call table%add(option('along', 'line of the rock that it covers, in which its axis lies; closed when it ends '// &
                            'where it begins', unit='length', columns='x, y', &
                            default_text='outline, or the line of the lining on which it lies'), liner%along)
      call table%add(option('outline', 'region whose outer line it follows', default_text='none', not_blank=.true.), &
                     liner%outline)
      call table%add(option('on', 'name of the lining on which this layer lies', default_text='none', &
                            not_blank=.true.), liner%on)
      call table%add(option('thickness', 'of the lining', unit='length', above=0.0_wp, default_text=needed), &
                     liner%thickness)
      call table%add(option('young', "Young's modulus", unit='stress', above=0.0_wp, default_text=needed), liner%young)
      call table%add(option('poisson', "Poisson's ratio", above=-1.0_wp, below=0.5_wp, default_text='0.2'), &
                     liner%poisson)
      call table%add(option('density', 'mass per area', unit='mass/length^2', above=0.0_wp, &
                            default_text='that of the first block material'), liner%density)
      call table%add(option('compressive_strength', 'at which it crushes', unit='stress', above=0.0_wp, &
                            default_text='none: it does not crush'), liner%compressive_strength)
      call table%add(option('tensile_strength', 'at which it cracks', unit='stress', least=0.0_wp, &
                            default_text='none: it does not crack'), liner%tensile_strength)
      call table%add(option('joint_material', 'between the lining and what it lies on: number or name', &
                            default_text='full bond', or_number=.true.), liner%joint_material)
      call table%add(option('element', 'largest distance of nodes', unit='length', above=0.0_wp, &
                            default_text='2 thickness, at least 24 nodes around a closed line'), liner%element)
   end subroutine describe_liner

   !> What is wrong with a lining by itself; empty: nothing.
   pure function liner_problem(liner) result(problem)
      type(liner_type), intent(in) :: liner
      character(len=:), allocatable :: problem
      problem = ''
      if (.not. is_set(liner%thickness)) then
         problem = 'thickness is missing'
      else if (.not. is_set(liner%young)) then
         problem = 'young is missing'
      else if (.not. (is_given(liner%on) .or. allocated(liner%along) .or. is_given(liner%outline))) then
         problem = 'along is missing, its line: give along = x1,y1, x2,y2, ... or outline = the name of a region'
      end if
   end function liner_problem

end module rockdda_model_support_options
